#include "compress/bake/lod/bound/surface_walk.h"

#include <algorithm>
#include <utility>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/lod/simplify/corner_lists.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxPathTriangles = 32; // maximum number of triangles on a path
// minimum sine (edge to normal) of a slice; minimum cosine (normals) of an image's triangle
constexpr double kSteep = 0.05;

uint32_t next_corner(uint32_t corner) { return CornerLists::next_corner(corner); }
uint32_t last_corner(uint32_t corner) { return CornerLists::last_corner(corner); }

} // namespace

SurfaceWalk::SurfaceWalk(const OverlaySurface& source, const SurfaceSide& simplified, const SimplifyMesh& mesh)
    : source_(source), simplified_(simplified), mesh_(mesh), places_(source.points.size()),
      ways_(mesh.edge_became.size()), side_of_edge_(mesh.edge_became.size(), kNone),
      corner_points_(4 * mesh.triangles.size()), opposite_(corner_points_.size(), kNone),
      normals_(mesh.triangles.size()), facing_(mesh.points.size()) {
  for (size_t t = 0; t < normals_.size(); ++t) {
    const Triangle& p = mesh.triangles[t].points;
    const DVec3 a = point(p.x);
    normals_[t] = glm::cross(point(p.y) - a, point(p.z) - a);
    for (int i = 0; i < 3; ++i) {
      corner_points_[4 * t + static_cast<size_t>(i)] = p[i];
      facing_[p[i]] += normals_[t];
    }
  }
  if (mesh.side_edges.empty()) return;
  pair_sides();
}

// ---- the simplified surface

/// Pairs opposite half-edges. Edges with more than two triangles, or with two of inconsistent orientation, have no
/// pairs.
void SurfaceWalk::pair_sides() {
  constexpr uint32_t kMany = kNone - 1;
  std::vector<uint32_t> second(ways_.size(), kNone);
  for (uint32_t t = 0; t < normals_.size(); ++t)
    for (uint32_t i = 0; i < 3; ++i) {
      const uint32_t edge = mesh_.edge_became[mesh_.side_edges[3 * mesh_.source[t] + i]], corner = 4 * t + i;
      const uint32_t other = side_of_edge_[edge];
      if (other == kNone)
        side_of_edge_[edge] = corner;
      else if (second[edge] == kNone && point_at(other) == point_at(next_corner(corner)) &&
               point_at(next_corner(other)) == point_at(corner))
        second[edge] = corner;
      else
        second[edge] = kMany;
    }
  for (size_t edge = 0; edge < second.size(); ++edge)
    if (const uint32_t a = side_of_edge_[edge], b = second[edge]; b < kMany) opposite_[a] = b, opposite_[b] = a;
}

// ---- paths

inline bool SurfaceWalk::make_slice(const DVec3& from, const DVec3& to, const DVec3& up, Slice& out) const {
  out.from = from, out.direction = to - from;
  out.left = glm::cross(up, out.direction);
  const double left2 = glm::dot(out.left, out.left), up2 = glm::dot(up, up);
  if (!(left2 > kSteep * kSteep * up2 * glm::dot(out.direction, out.direction))) return false;
  out.along = glm::cross(out.left, up) / left2;
  out.offset = glm::dot(out.left, from);
  return true;
}

inline bool SurfaceWalk::leave_point(const Slice& slice, uint32_t from, Exit& out) const {
  for (const uint32_t t : simplified_.around(from)) {
    const uint32_t* p = &corner_points_[4 * size_t{t}];
    const uint32_t corner = p[0] == from ? 1u : p[1] == from ? 2u : 0u;
    out.right = &point(p[corner]);
    out.side_right = slice.side(*out.right);
    if (!(out.side_right < 0.0)) continue;
    out.left = &point(p[corner == 2 ? 0 : corner + 1]);
    out.side_left = slice.side(*out.left);
    if (out.side_left < 0.0) continue;
    out.corner = 4 * t + corner;
    return true;
  }
  return false;
}

inline bool SurfaceWalk::leave_triangle(const Slice& slice, uint32_t triangle, Exit& out) const {
  const uint32_t* p = &corner_points_[4 * size_t{triangle}];
  const DVec3* points[3] = {&point(p[0]), &point(p[1]), &point(p[2])};
  const double sides[3] = {slice.side(*points[0]), slice.side(*points[1]), slice.side(*points[2])};
  for (uint32_t i = 0; i < 3; ++i) {
    const uint32_t next = i == 2 ? 0 : i + 1;
    if (!(sides[i] < 0.0) || sides[next] < 0.0) continue;
    out = {4 * triangle + i, points[i], points[next], sides[i], sides[next]};
    return true;
  }
  return false;
}

/// Finds where the path leaves the triangle that it enters through the side starting at `corner`.
inline void SurfaceWalk::enter(const Slice& slice, uint32_t corner, Exit& exit) const {
  const DVec3& next = point(point_at(last_corner(corner)));
  const double side = slice.side(next);
  if (side < 0.0)
    exit.corner = last_corner(corner), exit.right = &next, exit.side_right = side;
  else
    exit.corner = next_corner(corner), exit.left = &next, exit.side_left = side;
}

/// Walks from the simplified point that `source` became to where `source` projects onto the surface along the normal.
void SurfaceWalk::find_place(uint32_t source, Place& out) const {
  const uint32_t became = mesh_.stands_for[source];
  const DVec3 &from = point(became), &to = source_.points[source];
  out.state = Place::State::kPoint, out.number = became, out.at = from;
  if (from == to) return;
  out.state = Place::State::kNowhere;
  const DVec3& up = facing_[became];
  Slice slice;
  Exit exit;
  if (!make_slice(from, to, up, slice) || !leave_point(slice, became, exit)) {
    // Directly above or below the point, the point is the image.
    const DVec3 d = to - from;
    out.distance2 = glm::dot(d, d);
    if (const DVec3 left = glm::cross(up, d);
        glm::dot(left, left) <= kSteep * kSteep * glm::dot(up, up) * out.distance2)
      out.state = Place::State::kPoint;
    return;
  }
  for (uint32_t step = 0; step < kMaxPathTriangles; ++step) {
    const double t = exit.side_right / (exit.side_right - exit.side_left);
    const DVec3 crossing = *exit.right + t * (*exit.left - *exit.right);
    if (glm::dot(crossing - slice.from, slice.along) >= 1.0) {
      const uint32_t triangle = exit.corner / 4;
      const DVec3& normal = normals_[triangle];
      const double slope = glm::dot(normal, up), up2 = glm::dot(up, up);
      if (!(slope > 0.0) || slope * slope < kSteep * kSteep * glm::dot(normal, normal) * up2) return;
      const double height = glm::dot(normal, *exit.right - to) / slope;
      out.at = to + height * up, out.distance2 = height * height * up2;
      out.number = triangle, out.state = Place::State::kTriangle;
      return;
    }
    const uint32_t corner = opposite_[exit.corner];
    if (corner == kNone) return;
    enter(slice, corner, exit);
  }
}

void SurfaceWalk::find_path(uint32_t edge, uint32_t a, uint32_t b, EdgePath& out) {
  out.state = EdgePath::State::kNowhere;
  out.first = static_cast<uint32_t>(crossing_count_);
  const Place &from = place(a), &goal = place(b);
  if (from.state == Place::State::kNowhere || goal.state == Place::State::kNowhere) return;
  if (from.state == Place::State::kPoint && goal.state == Place::State::kPoint) {
    if (find_along(edge, from.number, goal.number, out)) return;
  } else {
    out.start = from.state == Place::State::kTriangle ? from.number : goal.number;
    if (from.state == Place::State::kTriangle ? at(from.number, goal) : has(goal.number, from.number)) {
      out.state = EdgePath::State::kAcross;
      return;
    }
  }
  Slice slice;
  const DVec3 up = facing_[mesh_.stands_for[a]] + facing_[mesh_.stands_for[b]];
  if (!make_slice(source_.points[a], source_.points[b], up, slice)) return;
  Exit exit;
  if (!(from.state == Place::State::kPoint ? leave_point(slice, from.number, exit)
                                           : leave_triangle(slice, from.number, exit)))
    return;
  out.start = exit.corner / 4;
  make_room();
  if (cross(slice, exit, goal)) out.state = EdgePath::State::kAcross;
  out.count = static_cast<uint32_t>(crossing_count_) - out.first;
  for (uint32_t i = 0; i < out.count; ++i) out.distance2 = std::max(out.distance2, crossings_[out.first + i].distance2);
}

/// Reserves space for the crossings of one more path.
inline void SurfaceWalk::make_room() {
  if (crossing_count_ + kMaxPathTriangles <= crossing_room_) return;
  crossing_room_ = std::max(2 * crossing_room_, 2 * ways_.size() + kMaxPathTriangles);
  auto larger = std::make_unique_for_overwrite<Crossing[]>(crossing_room_);
  std::copy_n(crossings_.get(), crossing_count_, larger.get());
  crossings_ = std::move(larger);
}

/// Continues from triangle to triangle up to the goal. Returns false if it is not reached.
inline bool SurfaceWalk::cross(const Slice& slice, Exit& exit, const Place& goal) {
  const bool to_point = goal.state == Place::State::kPoint;
  double last = 0.0;
  for (uint32_t step = 0; step < kMaxPathTriangles; ++step) {
    const double t = exit.side_right / (exit.side_right - exit.side_left);
    const DVec3 crossing = *exit.right + t * (*exit.left - *exit.right);
    const double on = glm::dot(crossing - slice.from, slice.along);
    if (on > 1.0 && step_aside(exit.corner / 4, goal, slice.from + slice.direction)) return true;
    last = std::clamp(on, last, 1.0);
    const DVec3 d = crossing - (slice.from + last * slice.direction);
    const uint32_t corner = opposite_[exit.corner];
    if (corner == kNone) return false;
    add(corner / 4, crossing, last, glm::dot(d, d));
    if (to_point ? point_at(last_corner(corner)) == goal.number : corner / 4 == goal.number) return true;
    enter(slice, corner, exit);
  }
  return false;
}

/// If the source edge is still an edge of the simplified surface, the path follows it.
bool SurfaceWalk::find_along(uint32_t edge, uint32_t from, uint32_t to, EdgePath& out) const {
  const uint32_t side = side_along(edge);
  if (side == kNone) return false;
  const uint32_t begin = point_at(side), end = point_at(next_corner(side));
  const bool forward = begin == from && end == to;
  if (!forward && !(begin == to && end == from)) return false;
  (forward ? out.start : out.right) = side / 4;
  (forward ? out.right : out.start) = across(side / 4, begin);
  out.state = EdgePath::State::kAlong;
  return true;
}

/// Handles paths that end just beyond another side of `triangle`: if the goal is across that side, adds a crossing
/// there.
bool SurfaceWalk::step_aside(uint32_t triangle, const Place& goal, const DVec3& end) {
  for (uint32_t i = 0; i < 3; ++i) {
    const uint32_t side = 4 * triangle + i, other = opposite_[side];
    if (other == kNone || !at(other / 4, goal)) continue;
    const DVec3 crossing = nearest_point(end, point(point_at(side)), point(point_at(next_corner(side))));
    const DVec3 d = end - crossing;
    add(other / 4, crossing, 1.0, glm::dot(d, d));
    return true;
  }
  return false;
}

} // namespace packtrace
