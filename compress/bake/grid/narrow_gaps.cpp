#include "compress/bake/grid/narrow_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include "compress/bake/grid/nearest_triangles.h"

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
constexpr size_t kGroupTriangles = 8; // of a block
constexpr size_t kMaxStarts = 32;
constexpr size_t kSampledTriangles = 1024; // about as many triangles estimate the number of tests

/// A segment along a surface normal, on which the facing surface is searched.
struct Probe {
  DVec3 origin, direction;
  double least_gap, reach; ///< distances along the direction at which surfaces are searched
  uint32_t point, triangle;

  DVec3 end() const { return origin + reach * direction; }
  DVec3 middle() const { return origin + 0.5 * reach * direction; }
};

/// Six ends of a box as vectors: a box overlaps another one if each of its lows() is at most the other's highs().
struct BoxEnds {
  using Pair = double __attribute__((vector_size(16)));
  std::array<Pair, 3> pairs;

  static BoxEnds lows(const Bounds& box) { return of({box.lo.x, box.lo.y, box.lo.z, -box.hi.x, -box.hi.y, -box.hi.z}); }
  static BoxEnds highs(const Bounds& box) {
    return of({box.hi.x, box.hi.y, box.hi.z, -box.lo.x, -box.lo.y, -box.lo.z});
  }
  bool at_most(const BoxEnds& other) const {
    const auto all = (pairs[0] <= other.pairs[0]) & (pairs[1] <= other.pairs[1]) & (pairs[2] <= other.pairs[2]);
    std::array<int64_t, 2> lanes;
    std::memcpy(lanes.data(), &all, sizeof lanes);
    return (lanes[0] & lanes[1]) != 0;
  }

private:
  static BoxEnds of(const std::array<double, 6>& ends) {
    BoxEnds out;
    std::memcpy(out.pairs.data(), ends.data(), sizeof ends);
    return out;
  }
};

/// Binary tree over probes.
class ProbeTree {
public:
  explicit ProbeTree(std::vector<Probe> probes) : probes_(std::move(probes)) {
    if (!probes_.empty()) build();
  }

  std::span<const Probe> probes() const { return probes_; }

  /// Numbers of nodes below which all probes lie that may overlap a box.
  struct Starts {
    std::array<uint32_t, kMaxStarts> nodes;
    size_t count = 0;

    std::span<const uint32_t> span() const { return std::span(nodes).first(count); }
  };
  Starts all() const { return {{0}, nodes_.empty() ? size_t{0} : size_t{1}}; }

  /// Leaves out nodes beside a smaller box and replaces inner nodes by those of their children that overlap it.
  Starts narrowed(const Starts& from, const Bounds& box) const {
    const BoxEnds highs = BoxEnds::highs(box);
    Starts out;
    for (const uint32_t node : from.span())
      if (nodes_[node].lows.at_most(highs)) out.nodes[out.count++] = node;
    for (size_t i = 0; i < out.count && out.count < kMaxStarts;) {
      const uint32_t left = out.nodes[i] + 1, right = nodes_[out.nodes[i]].right;
      if (right == 0) {
        ++i;
        continue;
      }
      const bool in_left = nodes_[left].lows.at_most(highs), in_right = nodes_[right].lows.at_most(highs);
      out.nodes[i] = in_left ? left : in_right ? right : out.nodes[--out.count];
      if (in_left && in_right) out.nodes[out.count++] = right;
    }
    return out;
  }

  /// Calls visit(index of a probe) for probes below some nodes, leaving out nodes whose box misses the triangle's box
  /// or plane.
  /// @return the number of tested boxes and probes
  template <typename Visit>
  size_t visit(const Starts& starts, const std::array<DVec3, 3>& t, DVec3 normal, const Visit& visit) const {
    Bounds box;
    for (const DVec3 corner : t) box.extend(corner);
    const BoxEnds highs = BoxEnds::highs(box);
    const DVec3 steep = glm::abs(normal) * (0.5 * kPad);
    std::array<uint32_t, kMaxStarts + 64> stack;
    size_t size = starts.count, tests = 0;
    std::copy_n(starts.nodes.begin(), size, stack.begin());
    while (size > 0) {
      const Node& node = nodes_[stack[--size]];
      ++tests;
      if (!node.lows.at_most(highs)) continue;
      if (std::abs(glm::dot(normal, node.centre - t[0])) > glm::dot(steep, node.extent)) continue;
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
    BoxEnds lows;
    DVec3 centre, extent;
    uint32_t right = 0; // the left child follows the node; 0 for leaves
    uint32_t first = 0, count = 0;
  };

  /// A probe's middle, by which probes are divided.
  struct Middle {
    DVec3 position;
    uint32_t probe;
  };

  void build() {
    std::vector<Middle> middles(probes_.size());
    for (uint32_t i = 0; i < middles.size(); ++i) middles[i] = {probes_[i].middle(), i};
    nodes_.resize(node_counts(probes_.size())[0]);
    add_node(middles, 0, 0);
    std::vector<Probe> ordered(probes_.size());
    for (size_t i = 0; i < ordered.size(); ++i) ordered[i] = probes_[middles[i].probe];
    probes_ = std::move(ordered);
  }

  /// Numbers of nodes of trees of `probes` and of `probes` + 1 probes; every node is cut into halves.
  static std::array<size_t, 2> node_counts(size_t probes) {
    if (probes < kLeafPoints) return {1, 1};
    const auto [half, more] = node_counts(probes / 2);
    const size_t even = 1 + 2 * (probes % 2 == 0 ? half : more), odd = 1 + half + more;
    return {probes == kLeafPoints ? 1 : probes % 2 == 0 ? even : odd, probes % 2 == 0 ? odd : even};
  }

  /// Adds the nodes of a subtree at `index`. Returns the bounds of its probes.
  Bounds add_node(std::span<Middle> middles, uint32_t first, size_t index) {
    constexpr size_t kParallelPoints = 4096; // smaller subtrees are built serially
    Bounds box;
    if (middles.size() <= kLeafPoints) {
      for (const Middle& middle : middles)
        box.extend(probes_[middle.probe].origin), box.extend(probes_[middle.probe].end());
      nodes_[index].first = first, nodes_[index].count = static_cast<uint32_t>(middles.size());
    } else {
      Bounds around;
      for (const Middle& middle : middles) around.extend(middle.position);
      const DVec3 extent = around.hi - around.lo;
      const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
      const size_t half = middles.size() / 2;
      std::nth_element(middles.begin(), middles.begin() + static_cast<std::ptrdiff_t>(half), middles.end(),
                       [axis](const Middle& a, const Middle& b) {
                         const double x = a.position[axis], y = b.position[axis];
                         return x < y || (x == y && a.probe < b.probe);
                       });
      const size_t right = index + 1 + node_counts(half)[0];
      nodes_[index].right = static_cast<uint32_t>(right);
      Bounds of_right;
      const auto add_left = [&] { box = add_node(middles.first(half), first, index + 1); };
      const auto add_right = [&] {
        of_right = add_node(middles.subspan(half), first + static_cast<uint32_t>(half), right);
      };
      if (middles.size() >= kParallelPoints) {
        tbb::parallel_invoke(add_left, add_right);
      } else {
        add_left();
        add_right();
      }
      box.extend(of_right);
    }
    nodes_[index].lows = BoxEnds::lows(box), nodes_[index].centre = box.centre(),
    nodes_[index].extent = box.hi - box.lo;
    return box;
  }

  std::vector<Probe> probes_;
  std::vector<Node> nodes_;
};

/// Distance along a probe to a triangle's plane if the probe hits the triangle; infinity otherwise.
/// @param least_facing kMinFacing times the length of `normal`
double hit_distance(const Probe& probe, const std::array<DVec3, 3>& t, DVec3 normal, double least_facing) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double facing = glm::dot(normal, probe.direction);
  if (!(std::abs(facing) >= least_facing)) return kNone;
  const DVec3 a = t[0] - probe.origin, b = t[1] - probe.origin, c = t[2] - probe.origin;
  const double u = glm::dot(glm::cross(b, c), probe.direction), v = glm::dot(glm::cross(c, a), probe.direction),
               w = glm::dot(glm::cross(a, b), probe.direction);
  if (!((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0))) return kNone;
  return glm::dot(a, normal) / facing;
}

/// Returns a box that contains all points of `box` after a transform whose results are rounded to floats.
Bounds moved_box(const DAffine& to_from, const Bounds& box) {
  constexpr double kRounding = 1e-6; // above the relative rounding error of a float
  constexpr double kLargest = 1e38;  // below the largest float
  const DVec3 far = glm::max(glm::abs(box.lo), glm::abs(box.hi));
  const DVec3 terms =
      glm::abs(to_from[0]) * far.x + glm::abs(to_from[1]) * far.y + glm::abs(to_from[2]) * far.z + glm::abs(to_from[3]);
  if (!(terms.x < kLargest && terms.y < kLargest && terms.z < kLargest))
    return {DVec3(-std::numeric_limits<double>::infinity()), DVec3(std::numeric_limits<double>::infinity())};
  Bounds moved = transform_bounds(to_from, box);
  moved.lo -= kRounding * terms, moved.hi += kRounding * terms;
  return moved;
}

/// Returns a box in world space that contains some triangles of a placed mesh. It may be larger than their exact box,
/// but transforms one box instead of each corner.
Bounds box_around(const PlacedPart& placed, const Mesh& mesh, std::span<const Triangle> triangles) {
  Vec3 lo(std::numeric_limits<float>::infinity()), hi(-lo);
  for (const Triangle& t : triangles)
    for (int corner = 0; corner < 3; ++corner) {
      const Vec3& p = mesh.positions[t[corner]];
      lo = glm::min(lo, p), hi = glm::max(hi, p);
    }
  Bounds box{DVec3(lo), DVec3(hi)};
  if (!placed.geometry_from_mesh.is_identity()) box = moved_box(placed.part->geometry_from_mesh, box);
  if (placed.placed) box = moved_box(placed.world_from_geometry, box);
  return box;
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
      const double step = parts_.part_of(p.triangle).step;
      probes.push_back({p.position, p.normal, kMinGapSteps * step,
                        std::min(kReachSteps * step, kMaxReach * box.diagonal()), i, p.triangle});
    }
    return probes;
  }

  /// Estimates the number of boxes and probes that all triangles are tested against.
  double expected_tests(const ProbeTree& tree) const {
    if (tree.probes().empty()) return 0.0;
    const uint32_t count = parts_.triangle_count();
    const auto stride = static_cast<uint32_t>(count / kSampledTriangles + 1);
    std::vector<size_t> tests(count / stride + 1);
    tbb::parallel_for(size_t{0}, tests.size(), [&](size_t i) {
      if (const auto number = static_cast<uint32_t>(i * stride); number < count) {
        const std::array<DVec3, 3> t = parts_.corners(number, &PlacedParts::source_position);
        tests[i] = tree.visit(tree.all(), t, glm::cross(t[1] - t[0], t[2] - t[0]), [](uint32_t) {});
      }
    });
    double sum = 0.0;
    for (const size_t n : tests) sum += static_cast<double>(n);
    return sum * stride;
  }

  /// Finds the nearest triangle per probe.
  void find_hits(const ProbeTree& tree) {
    hits_ = NearestTriangles(tree.probes().size());
    tbb::parallel_for(size_t{0}, parts_.parts().size(), [&](size_t part) {
      const PlacedPart& placed = parts_.parts()[part];
      const Mesh& mesh = parts_.mesh_of(placed);
      const size_t count = mesh.triangles.size();
      tbb::parallel_for(size_t{0}, (count + kBlockTriangles - 1) / kBlockTriangles, [&](size_t block) {
        const size_t begin = block * kBlockTriangles, end = std::min(begin + kBlockTriangles, count);
        const std::span<const Triangle> of_mesh = std::span(mesh.triangles).subspan(begin, end - begin);
        const ProbeTree::Starts near_block = tree.narrowed(tree.all(), box_around(placed, mesh, of_mesh));
        if (near_block.count == 0) return; // true of most blocks
        std::array<std::array<DVec3, 3>, kBlockTriangles> triangles;
        std::array<Bounds, kBlockTriangles / kGroupTriangles> boxes; // per group
        Bounds box;
        for (size_t i = begin; i < end; ++i)
          for (int corner = 0; corner < 3; ++corner) {
            const DVec3 p = parts_.source_position(placed, mesh.triangles[i][corner]);
            triangles[i - begin][static_cast<size_t>(corner)] = p;
            boxes[(i - begin) / kGroupTriangles].extend(p);
          }
        for (const Bounds& group : boxes) box.extend(group);
        const ProbeTree::Starts of_block = tree.narrowed(near_block, box);
        for (size_t first = begin; of_block.count > 0 && first < end; first += kGroupTriangles) {
          const ProbeTree::Starts starts = tree.narrowed(of_block, boxes[(first - begin) / kGroupTriangles]);
          for (size_t i = first; starts.count > 0 && i < std::min(first + kGroupTriangles, end); ++i)
            test(tree, starts, triangles[i - begin], placed.first_triangle + static_cast<uint32_t>(i));
        }
      });
    });
  }

  void test(const ProbeTree& tree, const ProbeTree::Starts& starts, const std::array<DVec3, 3>& t, uint32_t number) {
    const DVec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    const double least_facing = kMinFacing * glm::length(normal);
    tree.visit(starts, t, normal, [&](uint32_t i) {
      const Probe& probe = tree.probes()[i];
      if (probe.triangle == number) return;
      const double distance = hit_distance(probe, t, normal, least_facing);
      if (distance >= probe.least_gap && distance <= probe.reach) hits_.put(i, static_cast<float>(distance), number);
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
