#include "compress/bake/lod/bound/direct_bound.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "compress/bake/clusters/renumbering.h"
#include "compress/bake/lod/bound/stated_error.h"
#include "compress/bake/lod/bound/surface_side.h"
#include "compress/bake/lod/bound/triangle_refiner.h"
#include "compress/bake/lod/bound/triangle_set.h"

namespace packtrace {
namespace {

using Corners = std::array<DVec3, 3>;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-3; // steps; tolerance when triangles are clipped
constexpr double kSlack = 1.25;    // errors up to largest_ times this are not reduced further
// At most max(kFew, 1 / kMeasuredFraction of all triangles) are measured: if more have large errors, tightening them
// gains little.
constexpr size_t kFew = 512, kMeasuredFraction = 8;
// Maximum work per triangle of the group: distances and triangles looked at. Groups of fewer than
// kMinWorkTriangles triangles get as much as groups of that many, because their lower levels are many times as large.
constexpr size_t kWork = 400, kMinWorkTriangles = 256;

/// A convex planar polygon.
struct Polygon {
  std::array<DVec3, 10> corners;
  size_t count = 0;
};

/// Clips the polygon to dot(direction, p) <= limit.
Polygon cut(const Polygon& in, DVec3 direction, double limit) {
  Polygon out;
  for (size_t k = 0; k < in.count; ++k) {
    const DVec3 &p = in.corners[k == 0 ? in.count - 1 : k - 1], &q = in.corners[k];
    const double last = limit - glm::dot(direction, p), next = limit - glm::dot(direction, q);
    if ((last < 0.0) != (next < 0.0) && out.count < out.corners.size())
      out.corners[out.count++] = p + (last / (last - next)) * (q - p);
    if (next >= 0.0 && out.count < out.corners.size()) out.corners[out.count++] = q;
  }
  return out;
}

/// The region around a triangle that contains the surface that it represents: bounded by its plane and its three sides.
class Neighbourhood {
public:
  explicit Neighbourhood(const Corners& c) {
    const DVec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
    const double area = glm::length(normal);
    if (!(area > 0.0)) return;
    add(normal / area, c[0]), add(-normal / area, c[0]);
    for (size_t i = 0; i < 3; ++i) {
      const DVec3 outwards = glm::cross(c[(i + 1) % 3] - c[i], normal);
      const double length = glm::length(outwards);
      if (length > 0.0) add(outwards / length, c[i]);
    }
  }

  /// Clips a triangle to a convex superset of the points within `distance` of this one.
  Polygon part_within(const Corners& triangle, double distance) const {
    const double reach = distance + kRounding;
    Polygon polygon{{triangle[0], triangle[1], triangle[2]}, 3};
    for (size_t i = 0; i < count_ && polygon.count > 0; ++i) polygon = cut(polygon, directions_[i], limits_[i] + reach);
    return polygon;
  }

private:
  void add(DVec3 direction, DVec3 point) {
    directions_[count_] = direction, limits_[count_++] = glm::dot(direction, point);
  }
  std::array<DVec3, 5> directions_{};
  std::array<double, 5> limits_{};
  size_t count_ = 0;
};

/// Implements bound_directly() for one group.
class Tightener {
public:
  Tightener(const DirectBoundInput& input, SimplifyMesh& mesh, SurfaceLinks& links)
      : in_(input), m_(mesh), links_(links), simplified_({mesh.points, mesh.triangles}), largest_(input.floor) {
    simplified_.link();
  }

  void run() {
    fill_heap();
    size_t left = std::max(kFew, (in_.triangles.size() + m_.triangles.size()) / kMeasuredFraction);
    while (!heap_.empty() && heap_.front().first > limit() && left-- > 0 && !spent()) {
      std::pop_heap(heap_.begin(), heap_.end());
      const auto [stated, number] = heap_.back();
      heap_.pop_back();
      const bool is_source = number < in_.triangles.size();
      const uint32_t t = is_source ? number : number - static_cast<uint32_t>(in_.triangles.size());
      double& bound = is_source ? links_.bounds[t] : m_.triangles[t].error;
      bound = std::min(stated, is_source ? measure_source(t, stated) : measure_simplified(t, stated));
      if (bound > limit()) largest_ = bound;
    }
    links_.links.insert(links_.links.end(), found_.begin(), found_.end());
  }

private:
  /// Errors up to this limit are not measured further and do not raise largest_.
  double limit() const { return kSlack * largest_; }

  /// Limits the work in soups: where every triangle is near all others, more measuring gains little.
  bool spent() const {
    const size_t triangles = std::max(kMinWorkTriangles, in_.triangles.size() + m_.triangles.size());
    return work_ + refiner_.work() > kWork * triangles;
  }

  void fill_heap() {
    const auto add = [&](double stated, uint32_t number) {
      if (stated > limit()) heap_.emplace_back(stated, number);
    };
    for (uint32_t t = 0; t < in_.triangles.size(); ++t) add(links_.bounds[t], t);
    for (uint32_t s = 0; s < m_.triangles.size(); ++s)
      add(m_.triangles[s].error, static_cast<uint32_t>(in_.triangles.size()) + s);
    std::make_heap(heap_.begin(), heap_.end());
  }

  DVec3 point(uint32_t vertex) const {
    const LatticePoint& q = in_.levels.positions[in_.levels.vertices[vertex].position];
    DVec3 p;
    for (size_t axis = 0; axis < 3; ++axis) p[static_cast<int>(axis)] = static_cast<double>(q[axis] - in_.center[axis]);
    return p;
  }

  Corners corners_of(uint32_t number) const {
    const Triangle& t = in_.levels.triangles[number];
    return {point(t.x), point(t.y), point(t.z)};
  }

  Corners source_corners(uint32_t t) const {
    const Triangle& p = in_.triangles[t].points;
    return {in_.points[p.x], in_.points[p.y], in_.points[p.z]};
  }

  /// Replaces numbers_ by the triangles one level below that they may represent, keeping only triangles whose bounds,
  /// padded by their error, overlap the box. Returns false and leaves numbers_ unchanged where no lower level is known.
  bool go_back(const DVec3& lo, const DVec3& hi) {
    below_.clear();
    for (const uint32_t number : numbers_)
      for (const uint32_t below : in_.levels.history.below(number)) below_(below);
    if (below_.values.empty()) return false;
    numbers_.clear();
    for (const uint32_t number : below_.values) {
      const Corners c = corners_of(number);
      const double error = in_.levels.errors[number] + kRounding;
      const DVec3 least = glm::min(glm::min(c[0], c[1]), c[2]) - error;
      const DVec3 most = glm::max(glm::max(c[0], c[1]), c[2]) + error;
      if (least.x <= hi.x && least.y <= hi.y && least.z <= hi.z && most.x >= lo.x && most.y >= lo.y && most.z >= lo.z)
        numbers_.push_back(number);
    }
    work_ += below_.values.size();
    return true;
  }

  // ---- from lower levels to the simplified surface

  /// Bounds the error of a source triangle. Goes one level further back only for parts that are still too far off.
  double measure_source(uint32_t t, double stated) {
    const Corners corners = source_corners(t);
    const Neighbourhood near(corners);
    const double inherited = in_.triangles[t].error;
    const DVec3 lo = glm::min(glm::min(corners[0], corners[1]), corners[2]) - inherited;
    const DVec3 hi = glm::max(glm::max(corners[0], corners[1]), corners[2]) + inherited;
    gather_simplified(t);
    set_.clear(), vertices_.clear(), distances_.clear();
    for (const uint32_t s : simplified_.candidates()) set_.add(simplified_.surface(), s);
    double largest = 0.0, worst = 0.0; // of parts near enough, and of the others
    pieces_.clear(), worst_pieces_.clear();
    numbers_.assign(1, in_.numbers[t]);
    for (uint32_t depth = 0; depth < TriangleHistory::kDepth && (go_back(lo, hi) || depth == 0); ++depth) {
      worst = 0.0, worst_pieces_.clear();
      size_t kept = 0;
      for (const uint32_t below : numbers_) {
        if (spent()) return stated;
        const size_t source = worst_pieces_.size();
        const double bound = measure_below(t, near, below, depth, stated);
        if (bound <= limit()) {
          largest = std::max(largest, bound);
          pieces_.insert(pieces_.end(), worst_pieces_.begin() + static_cast<std::ptrdiff_t>(source),
                         worst_pieces_.end());
          worst_pieces_.resize(source);
        } else {
          worst = std::max(worst, bound);
          numbers_[kept++] = below;
        }
      }
      numbers_.resize(kept);
      if (kept == 0) break;
    }
    if (worst >= stated) return stated;
    pieces_.insert(pieces_.end(), worst_pieces_.begin(), worst_pieces_.end());
    for (const uint32_t s : pieces_) found_.push_back({t, s});
    return std::max(largest, worst);
  }

  /// Bounds the error of the part of lower-level triangle `below` that source triangle t represents. Appends the
  /// simplified triangles that it was measured against to worst_pieces_.
  double measure_below(uint32_t t, const Neighbourhood& near, uint32_t below, uint32_t depth, double stated) {
    const double error = in_.levels.errors[below], enough = (limit() - error) / kErrorInflation;
    const Corners corners = corners_of(below);
    if (const auto [s, distance] = nearest_to_all(below); distance <= enough) {
      worst_pieces_.push_back(s);
      return stated_error(distance, error);
    }
    const bool last = depth + 1 == TriangleHistory::kDepth || in_.levels.history.below(below).empty();
    const Polygon part = near.part_within(corners, in_.triangles[t].error + error);
    double largest = 0.0;
    for (size_t i = 2; i < part.count && largest < stated; ++i) {
      const Corners corners_part{part.corners[0], part.corners[i - 1], part.corners[i]};
      double distance = measure_part(corners_part, enough, kInfinite);
      if (distance > enough && last) {
        simplified_.gather_within(corners_part, std::min(distance, (stated - error) / kErrorInflation));
        work_ += m_.triangles.size();
        distance = measure_part(corners_part, enough, distance);
        gather_simplified(t);
      }
      largest = std::max(largest, stated_error(distance, error));
    }
    return largest;
  }

  /// Makes the simplified triangles around the points that t's corners became the candidates.
  void gather_simplified(uint32_t t) {
    const Triangle& p = in_.triangles[t].points;
    simplified_.gather({m_.stands_for[p.x], m_.stands_for[p.y], m_.stands_for[p.z]});
  }

  /// The triangle of set_ whose largest distance from a lower-level triangle is smallest, and that distance.
  std::pair<uint32_t, double> nearest_to_all(uint32_t below) {
    if (set_.empty()) return {0, kInfinite};
    const Triangle& t = in_.levels.triangles[below];
    const size_t rows[3] = {find_distances(t.x), find_distances(t.y), find_distances(t.z)};
    const double *from_a = &distances_[rows[0]], *from_b = &distances_[rows[1]], *from_c = &distances_[rows[2]];
    const NearestTriangle nearest = set_.nearest(from_a, from_b, from_c);
    return {set_.number(nearest.place), nearest.distance};
  }

  /// Index in distances_ of the row of a lower-level vertex. Cached, as neighbouring triangles share most vertices.
  size_t find_distances(uint32_t vertex) {
    const size_t first = vertices_(vertex) * set_.padded_size();
    if (first == distances_.size()) {
      distances_.resize(first + set_.padded_size());
      const DVec3 at = point(vertex);
      double* row = &distances_[first];
      set_.distances({&at, 1}, {&row, 1});
      work_ += set_.size();
    }
    return first;
  }

  /// Bounds how far a triangle lies from the candidates of the simplified surface.
  /// @param known an upper bound that is already known
  double measure_part(const Corners& part, double enough, double known) {
    best_.clear();
    double best = known;
    overlay(part, enough, best);
    if (best > enough) refine(part, enough, best);
    for (const auto& [s, d] : best_) worst_pieces_.push_back(s);
    return best;
  }

  /// Bounds by an overlay; replaces best_ and `best` if that bound is smaller.
  void overlay(const Corners& triangle, double enough, double& best) {
    overlay_.clear();
    work_ += simplified_.candidates().size();
    const DVec3 normal = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    Overlay& over = simplified_.overlay();
    if (!simplified_.overlay(triangle, normal, overlay_) && !over.overlay_over_borders(overlay_)) return;
    double largest = 0.0;
    for (OverlayPiece& piece : overlay_) {
      if (piece.distance > enough) piece.distance = over.nearest_distance(piece);
      largest = std::max(largest, piece.distance);
    }
    near_.clear();
    if (largest > enough && over.overlay_near([&](uint32_t, double d) { return d <= enough; }, near_)) {
      std::swap(overlay_, near_);
      largest = 0.0;
      for (const OverlayPiece& piece : overlay_) largest = std::max(largest, piece.distance);
    }
    if (largest >= best) return;
    best = largest;
    best_.clear();
    for (const OverlayPiece& piece : overlay_) best_.emplace_back(piece.triangle, piece.distance);
  }

  /// Bounds by subdivision; replaces best_ and `best` if that bound is smaller.
  void refine(const Corners& triangle, double enough, double& best) {
    tried_.clear();
    refiner_.begin(simplified_);
    refiner_.measure_corners(triangle);
    const double d = refiner_.run([&](double distance, uint32_t) { return distance <= enough; },
                                  [&](uint32_t s, double distance) { tried_.emplace_back(s, distance); });
    if (d < best) std::swap(best_, tried_), best = d;
  }

  // ---- from the simplified surface to lower levels

  /// Bounds the error of a simplified triangle. Goes back level by level while the bound exceeds limit().
  double measure_simplified(uint32_t s, double stated) {
    if (linked_.ends.empty()) linked_ = links_.by_simplified(m_.triangles.size());
    const Corners corners = simplified_.corners(s);
    const DVec3 lo = glm::min(glm::min(corners[0], corners[1]), corners[2]) - stated;
    const DVec3 hi = glm::max(glm::max(corners[0], corners[1]), corners[2]) + stated;
    numbers_.clear();
    for (uint32_t i = linked_.ends[s]; i < linked_.ends[s + 1]; ++i) numbers_.push_back(in_.numbers[linked_.source[i]]);
    double bound = stated;
    for (uint32_t depth = 0; depth < TriangleHistory::kDepth && bound > limit() && !spent() && go_back(lo, hi); ++depth)
      bound = std::min(bound, measure_against_lower(corners));
    return bound;
  }

  /// Whether an overlay shows that a simplified triangle is within limit() of the triangles in numbers_.
  /// @param bound set to its error bound if so
  bool is_near_lower(const Corners& corners, double& bound) {
    lower_positions_.clear(), lower_points_.clear(), lower_triangles_.clear(), lower_candidates_.clear();
    for (uint32_t i = 0; i < numbers_.size(); ++i) {
      LodTriangle t{};
      for (int corner = 0; corner < 3; ++corner) {
        const uint32_t vertex = in_.levels.triangles[numbers_[i]][corner];
        t.points[corner] = lower_positions_(in_.levels.vertices[vertex].position);
        if (t.points[corner] == lower_points_.size()) lower_points_.push_back(point(vertex));
      }
      lower_triangles_.push_back(t), lower_candidates_.push_back(i);
    }
    work_ += numbers_.size();
    lower_.reset({lower_points_, lower_triangles_});
    overlay_.clear(), near_.clear();
    const auto stated = [&](uint32_t i, double distance) {
      return stated_error(distance, in_.levels.errors[numbers_[i]]);
    };
    lower_.overlay(corners, glm::cross(corners[1] - corners[0], corners[2] - corners[0]), lower_candidates_, overlay_);
    if (!lower_.overlay_near([&](uint32_t i, double distance) { return stated(i, distance) <= limit(); }, near_))
      return false;
    bound = 0.0;
    for (const OverlayPiece& piece : near_) bound = std::max(bound, stated(piece.triangle, piece.distance));
    return true;
  }

  /// Bounds a simplified triangle by an overlay on the triangles in numbers_ or by subdivision.
  double measure_against_lower(const Corners& corners) {
    if (double bound = 0.0; is_near_lower(corners, bound)) return bound;
    TriangleSet& below = refiner_.begin();
    for (const uint32_t number : numbers_) below.add(corners_of(number), number);
    const auto stated = [&](double distance, uint32_t number) {
      return stated_error(distance, in_.levels.errors[number]);
    };
    double largest = numbers_.empty() ? kInfinite : 0.0;
    refiner_.measure_corners(corners);
    refiner_.run([&](double distance, uint32_t number) { return stated(distance, number) <= limit(); },
                 [&](uint32_t number, double distance) { largest = std::max(largest, stated(distance, number)); });
    return largest;
  }

  const DirectBoundInput& in_;
  SimplifyMesh& m_;
  SurfaceLinks& links_;
  SurfaceSide simplified_;
  double largest_; ///< the group's floor, or an error that no measurement could bring below limit()
  std::vector<std::pair<double, uint32_t>> heap_; ///< error bounds; source triangles first, then simplified ones
  LinkLists linked_;                              ///< set up on first use
  std::vector<SurfaceLink> found_;
  std::vector<uint32_t> numbers_, pieces_, worst_pieces_;
  Renumbering below_{512};        ///< triangles one level below
  TriangleSet set_;               ///< simplified triangles near the current source triangle
  Renumbering vertices_{512};     ///< lower-level vertices with known distances_
  std::vector<double> distances_; ///< set_.padded_size() entries per vertex
  std::vector<OverlayPiece> overlay_, near_;
  Overlay lower_; ///< on the lower-level triangles in numbers_, numbered by their place there
  Renumbering lower_positions_{512};
  std::vector<DVec3> lower_points_;
  std::vector<LodTriangle> lower_triangles_;
  std::vector<uint32_t> lower_candidates_;
  std::vector<std::pair<uint32_t, double>> best_, tried_;
  TriangleRefiner refiner_;
  size_t work_ = 0; ///< distances and triangles looked at, except those of refiner_
};

} // namespace

void bound_directly(const DirectBoundInput& input, SimplifyMesh& mesh, SurfaceLinks& links) {
  const auto below = [&](uint32_t number) { return !input.levels.history.below(number).empty(); };
  if (input.dropped || std::any_of(input.numbers.begin(), input.numbers.end(), below))
    Tightener(input, mesh, links).run();
  for (const SurfaceLink& link : links.links)
    mesh.triangles[link.simplified].error = std::max(mesh.triangles[link.simplified].error, links.bounds[link.source]);
}

} // namespace packtrace
