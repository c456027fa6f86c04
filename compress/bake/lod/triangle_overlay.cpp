#include "compress/bake/lod/triangle_overlay.h"

#include <algorithm>
#include <cmath>

#include "compress/bake/lod/triangle_distance.h"

namespace packtrace {
namespace {

constexpr double kCovered = 1e-6; // of the triangle's area may be left over: roundings
constexpr double kSteep = 0.05;   // cosine; what is steeper is not seen from there

} // namespace

DVec3 OverlaySurface::area_normal(uint32_t triangle) const {
  const DVec3& a = corner(triangle, 0);
  return glm::cross(corner(triangle, 1) - a, corner(triangle, 2) - a);
}

double OverlaySurface::distance(DVec3 p, uint32_t triangle) const {
  return glm::length(p - nearest_point(p, corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)));
}

bool Overlay::lay(const std::array<DVec3, 3>& triangle, DVec3 direction, std::span<const uint32_t> candidates,
                  std::vector<OverlayPiece>& pieces) {
  const double length = glm::length(direction);
  if (!(length > 0.0)) return false;
  const DVec3 z = direction / length;
  const DVec3 e1 = triangle[1] - triangle[0], e2 = triangle[2] - triangle[0], normal = glm::cross(e1, e2);
  const double seen = glm::dot(normal, z);
  if (!(std::abs(seen) > kSteep * glm::length(normal))) return false;
  // p = triangle[0] + l1 e1 + l2 e2 + height z
  triangle_ = triangle, direction_ = z;
  to_l1_ = glm::cross(e2, z) / seen, to_l2_ = glm::cross(z, e1) / seen, to_height_ = normal / seen;
  side_ = seen > 0.0 ? 1.0 : -1.0;
  ++stamp_value_;

  const size_t first = pieces.size();
  double covered = 0.0;
  for (size_t i = 0; i < candidates.size() && covered < 1.0 - kCovered; ++i) {
    double facing = 0.0;
    const double area = cut_out(candidates[i], polygon_, facing);
    if (!(area > 0.0)) continue;
    double height = 0.0;
    for (size_t k = 0; k < polygon_.count; ++k) height = std::max(height, std::abs(polygon_.corners[k].height));
    pieces.push_back({candidates[i], height, area / facing});
    covered += area;
  }
  if (covered >= 1.0 - kCovered && covered <= 1.0 + kCovered) return true;
  pieces.resize(first);
  return false;
}

const Overlay::Projected& Overlay::project(uint32_t point) {
  Projected& p = projected_[point];
  if (stamp_[point] == stamp_value_) return p;
  stamp_[point] = stamp_value_;
  const DVec3 d = surface_.points[point] - triangle_[0];
  p.corner = {glm::dot(d, to_l1_), glm::dot(d, to_l2_), glm::dot(d, to_height_)};
  const double l0 = p.corner.l(0);
  p.outside = static_cast<uint32_t>(l0 <= 0.0) | static_cast<uint32_t>(p.corner.l1 <= 0.0) << 1 |
              static_cast<uint32_t>(p.corner.l2 <= 0.0) << 2;
  p.beyond = static_cast<uint32_t>(l0 < 0.0) | static_cast<uint32_t>(p.corner.l1 < 0.0) << 1 |
             static_cast<uint32_t>(p.corner.l2 < 0.0) << 2;
  return p;
}

/// The part of a triangle of the surface that lies over the one at hand. Returns twice its area, where twice the area of
/// the latter is 1; facing becomes that of the whole triangle.
double Overlay::cut_out(uint32_t triangle, Polygon& polygon, double& facing) {
  const Triangle& points = surface_.triangles[triangle].points;
  const Projected &a = project(points.x), &b = project(points.y), &c = project(points.z);
  if ((a.outside & b.outside & c.outside) != 0) return 0.0;
  facing = side_ * ((b.corner.l1 - a.corner.l1) * (c.corner.l2 - a.corner.l2) -
                    (b.corner.l2 - a.corner.l2) * (c.corner.l1 - a.corner.l1));
  if (!(facing > 0.0)) return 0.0;
  polygon.corners[0] = a.corner, polygon.corners[1] = b.corner, polygon.corners[2] = c.corner;
  polygon.count = 3;
  const uint32_t cuts = a.beyond | b.beyond | c.beyond;
  if (cuts == 0) return facing;
  for (size_t i = 0; i < 3; ++i)
    if ((cuts & (1u << i)) != 0) {
      cut(polygon, i);
      if (polygon.count < 3) return 0.0;
    }
  double sum = 0.0;
  const Corner& o = polygon.corners[0];
  for (size_t i = 2; i < polygon.count; ++i) {
    const Corner &p = polygon.corners[i - 1], &q = polygon.corners[i];
    sum += (p.l1 - o.l1) * (q.l2 - o.l2) - (p.l2 - o.l2) * (q.l1 - o.l1);
  }
  return side_ * sum;
}

/// Keeps where the coordinate is not negative.
void Overlay::cut(Polygon& polygon, size_t coordinate) {
  const size_t count = polygon.count;
  std::array<Corner, kMaxCorners> in;
  std::copy_n(polygon.corners.begin(), count, in.begin());
  size_t out = 0;
  Corner p = in[count - 1];
  double last = p.l(coordinate);
  for (size_t i = 0; i < count; ++i) {
    const Corner& q = in[i];
    const double next = q.l(coordinate);
    if ((last < 0.0) != (next < 0.0)) {
      const double t = last / (last - next);
      polygon.corners[out++] = {p.l1 + t * (q.l1 - p.l1), p.l2 + t * (q.l2 - p.l2),
                                p.height + t * (q.height - p.height)};
    }
    if (next >= 0.0) polygon.corners[out++] = q;
    p = q, last = next;
  }
  polygon.count = out;
}

double Overlay::nearest_distance(const OverlayPiece& piece) {
  double facing = 0.0, largest = 0.0;
  cut_out(piece.triangle, polygon_, facing);
  const DVec3 e1 = triangle_[1] - triangle_[0], e2 = triangle_[2] - triangle_[0];
  for (size_t i = 0; i < polygon_.count; ++i) {
    const Corner& c = polygon_.corners[i];
    const DVec3 on = triangle_[0] + c.l1 * e1 + c.l2 * e2, over = on + c.height * direction_;
    largest = std::max({largest, surface_.distance(on, piece.triangle),
                        glm::length(over - nearest_point(over, triangle_[0], triangle_[1], triangle_[2]))});
  }
  return std::min(largest, piece.distance);
}

} // namespace packtrace
