#include "compress/bake/lod/bound/surface_walk.h"

#include <algorithm>
#include <utility>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/lod/simplify/corner_lists.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxPathTriangles = 32; // maximum number of triangles on a path
constexpr uint32_t kMaxTurns = 12;         // maximum number of triangles on a path around one point
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

/// Projects a point onto the surface along the normal or, where that fails at folds and borders, takes the nearest
/// position around the simplified point that it became.
void SurfaceWalk::find_place(uint32_t source, Place& out) const {
  project(source, out);
  if (out.state == Place::State::kNowhere) place_nearest(source, out);
}

void SurfaceWalk::place_nearest(uint32_t source, Place& out) const {
  const DVec3& from = source_.points[source];
  for (const uint32_t t : simplified_.around(mesh_.stands_for[source])) {
    const uint32_t* p = &corner_points_[4 * size_t{t}];
    const DVec3 at = nearest_point(from, point(p[0]), point(p[1]), point(p[2])), d = from - at;
    const double distance2 = glm::dot(d, d);
    if (out.state == Place::State::kTriangle && distance2 >= out.distance2) continue;
    out.at = at, out.distance2 = distance2, out.number = t, out.state = Place::State::kTriangle;
  }
}

/// Walks from the simplified point that `source` became to where `source` projects onto the surface along the normal.
void SurfaceWalk::project(uint32_t source, Place& out) const {
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
  make_room();
  if (find_straight(a, b, from, goal, out) || find_around(a, b, from, goal, out)) out.state = EdgePath::State::kAcross;
  out.count = static_cast<uint32_t>(crossing_count_) - out.first;
  for (uint32_t i = 0; i < out.count; ++i) out.distance2 = std::max(out.distance2, crossings_[out.first + i].distance2);
}

/// Finds the path in the plane of the edge and the surface normals.
bool SurfaceWalk::find_straight(uint32_t a, uint32_t b, const Place& from, const Place& goal, EdgePath& out) {
  Slice slice;
  const DVec3 up = facing_[mesh_.stands_for[a]] + facing_[mesh_.stands_for[b]];
  if (!make_slice(source_.points[a], source_.points[b], up, slice)) return false;
  Exit exit;
  if (!(from.state == Place::State::kPoint ? leave_point(slice, from.number, exit)
                                           : leave_triangle(slice, from.number, exit)))
    return false;
  out.start = exit.corner / 4;
  return cross(slice, exit, goal);
}

/// Counts the triangles from `triangle` around a point, in one direction, to the first that `wanted` accepts; kNone if
/// there is none.
template <typename Wanted>
uint32_t SurfaceWalk::turns(uint32_t& triangle, uint32_t around, bool forward, const Wanted& wanted) const {
  for (uint32_t count = 0; count < kMaxTurns; ++count) {
    if (wanted(triangle)) return count;
    triangle = beyond(side_at(triangle, around, forward));
    if (triangle == kNone) break;
  }
  return kNone;
}

/// Finds the shortest path around the points that both ends became, for folds and borders where no plane meets the
/// triangles between them.
bool SurfaceWalk::find_around(uint32_t a, uint32_t b, const Place& from, const Place& goal, EdgePath& out) {
  crossing_count_ = out.first;
  const uint32_t first = mesh_.stands_for[a], second = mesh_.stands_for[b];
  const auto reached = [&](uint32_t t) { return at(t, goal); };
  const auto has_second = [&](uint32_t t) { return has(t, second); };
  uint32_t start = kNone, best = kNone;
  bool forward[2] = {};
  const auto consider = [&](uint32_t begin) {
    if (!has(begin, first)) return;
    for (int way = 0; way < 4; ++way) {
      uint32_t t = begin;
      const uint32_t one = first == second ? 0 : turns(t, first, (way & 1) != 0, has_second);
      if (one == kNone) continue;
      const uint32_t two = turns(t, second, (way & 2) != 0, reached);
      if (two == kNone || one + two >= best) continue;
      best = one + two, start = begin, forward[0] = (way & 1) != 0, forward[1] = (way & 2) != 0;
    }
  };
  if (from.state == Place::State::kTriangle)
    consider(from.number);
  else
    for (const uint32_t t : simplified_.around(first))
      if (has_second(t)) consider(t);
  if (best == kNone) return false;
  out.start = start;
  double on = 0.0;
  uint32_t t = start;
  for (; first != second && !has_second(t); t = beyond(side_at(t, first, forward[0])))
    cross_side(a, b, side_at(t, first, forward[0]), on);
  for (; !reached(t); t = beyond(side_at(t, second, forward[1]))) cross_side(a, b, side_at(t, second, forward[1]), on);
  return true;
}

/// Adds a crossing of a side where it is near the edge from a to b.
/// @param on parameter of the last crossing on the edge; set to that of this one
void SurfaceWalk::cross_side(uint32_t a, uint32_t b, uint32_t corner, double& on) {
  const DVec3 &p = source_.points[a], &q = source_.points[b];
  const DVec3 &c = point(point_at(corner)), &d = point(point_at(next_corner(corner)));
  const DVec3 edge = q - p, side = d - c, between = p - c;
  const double ee = glm::dot(edge, edge), es = glm::dot(edge, side), ss = glm::dot(side, side);
  const double eb = glm::dot(edge, between), sb = glm::dot(side, between), scale = ee * ss - es * es;
  if (scale > 0.0) on = std::clamp((es * sb - eb * ss) / scale, on, 1.0);
  const DVec3 there = p + on * edge;
  const double t = ss > 0.0 ? std::clamp(glm::dot(there - c, side) / ss, 0.0, 1.0) : 0.0;
  const DVec3 crossing = c + t * side, off = crossing - there;
  add(opposite_[corner] / 4, crossing, on, glm::dot(off, off));
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
