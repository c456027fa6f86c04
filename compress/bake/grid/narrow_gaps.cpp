#include "compress/bake/grid/narrow_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <tbb/parallel_for.h>

#include "compress/bake/grid/nearest_triangles.h"
#include "compress/bake/grid/touching_boxes.h"

namespace packtrace {
namespace {

constexpr double kReachSteps = 32.0;
constexpr double kMaxReach = 1.0 / 32.0;    // of the visible points' extent
constexpr double kMinGapSteps = 1.0 / 64.0; // surfaces closer than this coincide
constexpr double kMinFacing = 0.7;          // cosine between the surface's normal and the reversed one of the other
constexpr double kMaxTests = 0x1p24;        // boxes and triangles tested per image
constexpr size_t kMinPoints = 512;
constexpr size_t kLeafPoints = 4;
constexpr size_t kBlockTriangles = 64;
constexpr size_t kSampledTriangles = 1024; // about as many triangles estimate the number of tests

/// A segment along a surface normal, on which the facing surface is searched.
struct Probe {
  DVec3 origin, direction;
  double reach;
  uint32_t point;

  DVec3 end() const { return origin + reach * direction; }
  DVec3 middle() const { return origin + 0.5 * reach * direction; }
};

/// Binary tree over probes.
class ProbeTree {
public:
  explicit ProbeTree(std::vector<Probe> probes) : probes_(std::move(probes)) {
    if (!probes_.empty()) add_node(0, probes_.size());
  }

  std::span<const Probe> probes() const { return probes_; }

  /// The smallest subtree that contains all probes that may overlap a box; nullopt if there are none.
  std::optional<uint32_t> subtree_of(const Bounds& box) const {
    if (nodes_.empty() || !overlap(nodes_[0].box, box)) return std::nullopt;
    uint32_t node = 0;
    while (nodes_[node].right != 0) {
      const bool left = overlap(nodes_[node + 1].box, box), right = overlap(nodes_[nodes_[node].right].box, box);
      if (!left && !right) return std::nullopt;
      if (left && right) break;
      node = left ? node + 1 : nodes_[node].right;
    }
    return node;
  }

  /// Calls visit(index of a probe) for probes of a subtree, leaving out nodes whose box misses the triangle's box or
  /// plane.
  /// @return the number of tested boxes and probes
  template <typename Visit>
  size_t visit(uint32_t subtree, const std::array<DVec3, 3>& t, DVec3 normal, const Visit& visit) const {
    Bounds box;
    for (const DVec3 corner : t) box.extend(corner);
    std::array<uint32_t, 64> stack;
    size_t size = 0, tests = 0;
    stack[size++] = subtree;
    while (size > 0) {
      const Node& node = nodes_[stack[--size]];
      ++tests;
      if (!overlap(node.box, box)) continue;
      const DVec3 half = 0.5 * (node.box.hi - node.box.lo);
      if (std::abs(glm::dot(normal, node.box.lo + half - t[0])) > glm::dot(glm::abs(normal), half) * kPad) continue;
      if (node.right != 0) {
        stack[size++] = node.right;
        stack[size++] = static_cast<uint32_t>(&node - nodes_.data()) + 1;
      } else {
        for (uint32_t i = node.first; i < node.first + node.count; ++i) visit(i);
        tests += node.count;
      }
    }
    return tests;
  }

private:
  static constexpr double kPad = 1.0 + 1e-9;

  struct Node {
    Bounds box;
    uint32_t right = 0; // the left child follows the node; 0 for leaves
    uint32_t first = 0, count = 0;
  };

  uint32_t add_node(size_t begin, size_t end) {
    const auto index = static_cast<uint32_t>(nodes_.size());
    nodes_.emplace_back();
    Bounds box, middles;
    for (size_t i = begin; i < end; ++i) {
      box.extend(probes_[i].origin), box.extend(probes_[i].end());
      middles.extend(probes_[i].middle());
    }
    nodes_[index].box = box;
    if (end - begin <= kLeafPoints) {
      nodes_[index].first = static_cast<uint32_t>(begin), nodes_[index].count = static_cast<uint32_t>(end - begin);
      return index;
    }
    const DVec3 extent = middles.hi - middles.lo;
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const size_t half = begin + (end - begin) / 2;
    const auto at = [&](size_t i) { return probes_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(half), at(end), [&](const Probe& a, const Probe& b) {
      const double x = a.middle()[axis], y = b.middle()[axis];
      return x < y || (x == y && a.point < b.point);
    });
    add_node(begin, half);
    const uint32_t right = add_node(half, end);
    nodes_[index].right = right;
    return index;
  }

  std::vector<Probe> probes_;
  std::vector<Node> nodes_;
};

/// Distance along a probe to a triangle's plane if the probe hits the triangle; infinity otherwise.
double hit_distance(const Probe& probe, const std::array<DVec3, 3>& t, DVec3 normal) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double facing = glm::dot(normal, probe.direction);
  if (!(std::abs(facing) >= kMinFacing * glm::length(normal))) return kNone;
  const DVec3 a = t[0] - probe.origin, b = t[1] - probe.origin, c = t[2] - probe.origin;
  const double u = glm::dot(glm::cross(b, c), probe.direction), v = glm::dot(glm::cross(c, a), probe.direction),
               w = glm::dot(glm::cross(a, b), probe.direction);
  if (!((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0))) return kNone;
  return glm::dot(a, normal) / facing;
}

class GapMeasurer {
public:
  GapMeasurer(const PlacedParts& parts, const VisiblePoints& points)
      : parts_(parts), points_(points.source), rounded_(points.rounded) {}

  std::vector<float> run() {
    std::vector<Probe> all = probes();
    std::vector<float> changes(points_.size(), 0.0f);
    size_t stride = 1;
    ProbeTree tree(all);
    if (const double tests = expected_tests(tree); tests > kMaxTests) {
      stride = std::min(static_cast<size_t>(tests / kMaxTests) + 1, std::max(all.size() / kMinPoints, size_t{1}));
      std::vector<Probe> few;
      for (size_t i = 0; i < all.size(); ++i) {
        if (i % stride == 0)
          few.push_back(all[i]);
        else
          changes[all[i].point] = std::numeric_limits<float>::quiet_NaN();
      }
      tree = ProbeTree(std::move(few));
    }
    find_hits(tree);
    tbb::parallel_for(size_t{0}, tree.probes().size(), [&](size_t i) {
      if (!hits_.empty(i)) changes[tree.probes()[i].point] = change_of(tree.probes()[i], hits_.triangle(i));
    });
    return changes;
  }

private:
  std::vector<Probe> probes() const {
    Bounds box;
    for (const VisiblePoint& p : points_)
      if (p.geometry != baked::kNone && is_finite(p.position)) box.extend(p.position);
    std::vector<Probe> probes;
    for (uint32_t i = 0; i < points_.size(); ++i) {
      const VisiblePoint& p = points_[i];
      if (p.geometry == baked::kNone || !is_finite(p.position) || !is_finite(p.normal)) continue;
      const double reach = std::min(kReachSteps * step_of(p), kMaxReach * box.diagonal());
      probes.push_back({p.position, p.normal, reach, i});
    }
    return probes;
  }

  double step_of(const VisiblePoint& p) const { return parts_.part_of(p.triangle).step; }

  /// Estimates the number of boxes and probes that all triangles are tested against.
  double expected_tests(const ProbeTree& tree) const {
    if (tree.probes().empty()) return 0.0;
    const uint32_t count = parts_.triangle_count();
    const auto stride = static_cast<uint32_t>(count / kSampledTriangles + 1);
    std::vector<size_t> tests(count / stride + 1);
    tbb::parallel_for(size_t{0}, tests.size(), [&](size_t i) {
      if (const auto number = static_cast<uint32_t>(i * stride); number < count) {
        const std::array<DVec3, 3> t = parts_.corners(number, &PlacedParts::source_position);
        tests[i] = tree.visit(0, t, glm::cross(t[1] - t[0], t[2] - t[0]), [](uint32_t) {});
      }
    });
    double sum = 0.0;
    for (const size_t n : tests) sum += static_cast<double>(n);
    return sum * stride;
  }

  /// Finds the nearest triangle per probe.
  void find_hits(const ProbeTree& tree) {
    hits_ = NearestTriangles(tree.probes().size());
    for (const PlacedPart& placed : parts_.parts()) {
      const Mesh& mesh = parts_.mesh_of(placed);
      const size_t count = mesh.triangles.size();
      tbb::parallel_for(size_t{0}, (count + kBlockTriangles - 1) / kBlockTriangles, [&](size_t block) {
        const size_t begin = block * kBlockTriangles, end = std::min(begin + kBlockTriangles, count);
        std::array<std::array<DVec3, 3>, kBlockTriangles> triangles;
        Bounds box;
        for (size_t i = begin; i < end; ++i)
          for (int corner = 0; corner < 3; ++corner) {
            const DVec3 p = parts_.source_position(placed, mesh.triangles[i][corner]);
            triangles[i - begin][static_cast<size_t>(corner)] = p;
            box.extend(p);
          }
        const std::optional<uint32_t> subtree = tree.subtree_of(box);
        for (size_t i = begin; subtree && i < end; ++i)
          test(tree, *subtree, triangles[i - begin], placed.first_triangle + static_cast<uint32_t>(i));
      });
    }
  }

  void test(const ProbeTree& tree, uint32_t subtree, const std::array<DVec3, 3>& t, uint32_t number) {
    const DVec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    tree.visit(subtree, t, normal, [&](uint32_t i) {
      const Probe& probe = tree.probes()[i];
      const VisiblePoint& point = points_[probe.point];
      if (point.triangle == number) return;
      const double distance = hit_distance(probe, t, normal);
      if (distance >= kMinGapSteps * step_of(point) && distance <= probe.reach)
        hits_.put(i, static_cast<float>(distance), number);
    });
  }

  /// Distance along the probe to a triangle's plane; not finite if the triangle has no area.
  double plane_distance(const Probe& probe, uint32_t triangle, PlacedParts::Position position) const {
    const std::array<DVec3, 3> t = parts_.corners(triangle, position);
    const DVec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    return glm::dot(t[0] - probe.origin, normal) / glm::dot(probe.direction, normal);
  }

  float change_of(const Probe& probe, uint32_t other) const {
    const double gap = plane_distance(probe, other, &PlacedParts::source_position);
    const double rounded = plane_distance(probe, other, &PlacedParts::rounded_position) -
                           plane_distance(probe, points_[probe.point].triangle, &PlacedParts::rounded_position);
    const VisiblePoint& after = rounded_[probe.point];
    const DVec3 moved = after.position - probe.origin;
    const bool same = after.triangle == points_[probe.point].triangle && after.geometry != baked::kNone;
    const double along = same ? glm::length(moved - glm::dot(moved, probe.direction) * probe.direction) : 0.0;
    const double change = (std::abs(rounded - gap) + along) / gap;
    return change < 1.0 ? static_cast<float>(change) : 1.0f; // also for NaN
  }

  const PlacedParts& parts_;
  const std::span<const VisiblePoint> points_, rounded_;
  NearestTriangles hits_{0}; // per probe
};

} // namespace

std::vector<float> measure_gap_changes(const PlacedParts& parts, const VisiblePoints& points) {
  return GapMeasurer(parts, points).run();
}

} // namespace packtrace
