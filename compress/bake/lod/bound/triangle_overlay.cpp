#include "compress/bake/lod/bound/triangle_overlay.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace {
namespace {

constexpr double kEdgeOn = 0.05;              // cosine; steeper triangles count as edge-on
constexpr double kCoverageRounding = 1e-6;    // tolerance of the coverage, which is an integer
constexpr double kMinCoverage = 1e-3;         // by the largest piece, of triangles that stick out over borders
constexpr double kFullCoverage = 1.0 - 1e-12; // coverage at which the search stops: usually all of it is covered
static_assert(sizeof(DVec3) == 3 * sizeof(double));

OverlayKernel pick_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::overlay_kernel;
#endif
  return overlay_kernel;
}

/// Derivatives of the coordinates along one axis.
OverlayPoint slopes(double l1, double l2, double height) { return {-(l1 + l2), l1, l2, height}; }

double coordinate(const OverlayPoint& p, int i) { return i == 0 ? p.l0 : i == 1 ? p.l1 : p.l2; }

/// Clips to where a linear function is not negative.
template <typename Function>
OverlayPolygon cut(const OverlayPolygon& in, const Function& function) {
  OverlayPolygon out{{}, 0};
  for (size_t k = 0; k < in.count; ++k) {
    const OverlayPoint &p = in.corners[k == 0 ? in.count - 1 : k - 1], &q = in.corners[k];
    const double last = function(p), next = function(q);
    if ((last < 0.0) != (next < 0.0)) {
      const double t = last / (last - next);
      out.corners[out.count++] = {p.l0 + t * (q.l0 - p.l0), p.l1 + t * (q.l1 - p.l1), p.l2 + t * (q.l2 - p.l2),
                                  p.height + t * (q.height - p.height)};
    }
    if (next >= 0.0) out.corners[out.count++] = q;
  }
  return out;
}

/// Positive where a point is to the left of the line from p to q.
double left_of(const OverlayPoint& p, const OverlayPoint& q, const OverlayPoint& at) {
  return (q.l1 - p.l1) * (at.l2 - p.l2) - (q.l2 - p.l2) * (at.l1 - p.l1);
}

} // namespace

DVec3 OverlaySurface::area_normal(uint32_t triangle) const {
  const DVec3& a = corner(triangle, 0);
  return glm::cross(corner(triangle, 1) - a, corner(triangle, 2) - a);
}

double OverlaySurface::distance(DVec3 p, uint32_t triangle) const {
  return glm::length(p - nearest_point(p, corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)));
}

Overlay::Overlay(const OverlaySurface& surface) : surface_(surface) {}

void Overlay::prepare() {
  if (const size_t count = surface_.points.size(); count > stamps_.size())
    projected_.resize(count), outside_.resize(count), stamps_.resize(count);
  corners_.resize(3 * surface_.triangles.size());
  uint32_t* corner = corners_.data();
  for (const LodTriangle& t : surface_.triangles)
    for (int i = 0; i < 3; ++i) *corner++ = t.points[i];
  task_.corners = corners_.data();
  task_.projected = projected_.data();
  task_.outside = outside_.data();
  task_.stamps = stamps_.data();
}

bool Overlay::overlay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::span<const uint32_t> candidates,
                      std::vector<OverlayPiece>& pieces) {
  static const OverlayKernel kernel = pick_kernel();
  found_count_ = 0;
  open_sides_known_ = false;
  const double length = glm::length(direction);
  if (!(length > 0.0) || candidates.empty()) return false;
  if (corners_.empty()) prepare();
  const DVec3 z = direction / length;
  triangle_ = triangle, direction_ = z;
  const DVec3 normal = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  double seen = glm::dot(normal, z);
  if (!(std::abs(seen) > kEdgeOn * glm::length(normal))) return false;
  if (seen < 0.0) std::swap(triangle_[1], triangle_[2]), seen = -seen; // seen from behind
  const DVec3 e1 = triangle_[1] - triangle_[0], e2 = triangle_[2] - triangle_[0];
  // p = triangle_[0] + l1 e1 + l2 e2 + height z
  const double scale = 1.0 / seen;
  const DVec3 l1 = glm::cross(e2, z) * scale, l2 = glm::cross(z, e1) * scale, height = glm::cross(e1, e2) * scale;
  task_.points = &surface_.points[0].x;
  for (int axis = 0; axis < 3; ++axis) task_.origin[axis] = triangle_[0][axis];
  task_.from_x = slopes(l1.x, l2.x, height.x);
  task_.from_y = slopes(l1.y, l2.y, height.y);
  task_.from_z = slopes(l1.z, l2.z, height.z);
  ++task_.stamp;

  if (found_.size() < candidates.size()) found_.resize(candidates.size());
  task_.enough = kFullCoverage;
  OverlayCover cover{};
  const auto find = [&] {
    found_count_ = kernel(task_, candidates.data(), static_cast<uint32_t>(candidates.size()), found_.data(), &cover);
    largest_piece_ = cover.largest;
  };
  const auto no_open_sides = [&] {
    find_open_sides(std::span(found_).first(found_count_));
    open_sides_known_ = true;
    return open_sides_.empty();
  };
  find();
  if (cover.count < 1.0 - kCoverageRounding) return false;
  bool together = no_open_sides();
  if (!together && cover.count >= kFullCoverage) {
    task_.enough = std::numeric_limits<double>::infinity();
    find();
    together = no_open_sides();
  }
  if (!together || std::abs(cover.count - std::round(cover.count)) > kCoverageRounding) return false;
  pieces.insert(pieces.end(), found_.begin(), found_.begin() + found_count_);
  return true;
}

/// Sets open_sides_ to the candidate sides through the interior that are borders of the pieces.
void Overlay::find_open_sides(std::span<const OverlayPiece> pieces) {
  open_sides_.clear();
  for (const OverlayPiece& piece : pieces)
    for (uint32_t i = 0; i < 3; ++i) {
      if ((piece.inner_sides >> i & 1) == 0) continue;
      const uint32_t* points = &corners_[size_t{3} * piece.triangle];
      const uint32_t from = points[i], to = points[i == 2 ? 0 : i + 1];
      // Looks at all sides, as that takes less time than mispredicting where the search ends.
      const uint64_t back = OpenSide::ends_of(to, from);
      size_t found = open_sides_.size();
      for (size_t k = open_sides_.size(); k-- > 0;) found = open_sides_[k].ends == back ? k : found;
      if (found == open_sides_.size())
        open_sides_.push_back({OpenSide::ends_of(from, to), piece.triangle});
      else
        open_sides_[found] = open_sides_.back(), open_sides_.pop_back();
    }
}

OverlayPolygon Overlay::overlap(const OverlayPiece& piece) const {
  const uint32_t* points = &corners_[size_t{3} * piece.triangle];
  OverlayPolygon polygon{{projected_[points[0]], projected_[points[1]], projected_[points[2]]}, 3};
  for (int i = 0; i < 3; ++i) polygon = cut(polygon, [i](const OverlayPoint& p) { return coordinate(p, i); });
  return polygon;
}

/// Finds the centroid of a piece's corners. Returns false if the piece is so small that rounding could move it out.
bool Overlay::find_point_in(const OverlayPiece& piece, OverlayPoint& out) const {
  const OverlayPolygon polygon = overlap(piece);
  const double share = 1.0 / static_cast<double>(std::max<size_t>(polygon.count, 1));
  double area = 0.0;
  for (size_t i = 0; i < polygon.count; ++i) {
    const OverlayPoint &p = polygon.corners[i], &q = polygon.corners[i + 1 == polygon.count ? 0 : i + 1];
    out.l1 += share * p.l1, out.l2 += share * p.l2;
    area += p.l1 * q.l2 - p.l2 * q.l1;
  }
  return area > kMinCoverage;
}

/// The largest distance, from an open side's candidate, of the overlaid triangle's part that is beyond the side as seen
/// from a covered point; negative if there is none.
double Overlay::distance_beyond(const OpenSide& side, const OverlayPoint& covered) const {
  const OverlayPoint &p = projected_[side.from()], &q = projected_[side.to()];
  if (!(left_of(p, q, covered) > 0.0)) return -1.0;
  OverlayPolygon part{{OverlayPoint{1.0, 0.0, 0.0, 0.0}, {0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}}, 3};
  part = cut(part, [&](const OverlayPoint& at) { return -left_of(p, q, at); });
  part = cut(part, [&](const OverlayPoint& at) { return left_of(covered, p, at); });
  part = cut(part, [&](const OverlayPoint& at) { return -left_of(covered, q, at); });
  double largest = -1.0;
  for (size_t i = 0; i < part.count; ++i) {
    const OverlayPoint& c = part.corners[i];
    const DVec3 on = triangle_[0] + c.l1 * (triangle_[1] - triangle_[0]) + c.l2 * (triangle_[2] - triangle_[0]);
    largest = std::max(largest, surface_.distance(on, side.triangle));
  }
  return largest;
}

double Overlay::nearest_distance(const OverlayPiece& piece) const {
  if (piece.inner_sides == OverlayPiece::kBeyondSide) return piece.distance; // measured to nearest points
  const OverlayPolygon polygon = overlap(piece);
  const DVec3 e1 = triangle_[1] - triangle_[0], e2 = triangle_[2] - triangle_[0];
  double largest = 0.0;
  for (size_t i = 0; i < polygon.count; ++i) {
    const OverlayPoint& c = polygon.corners[i];
    largest = std::max(largest, surface_.distance(triangle_[0] + c.l1 * e1 + c.l2 * e2, piece.triangle));
  }
  return polygon.count < 3 ? piece.distance : std::min(largest, piece.distance);
}

} // namespace packtrace
