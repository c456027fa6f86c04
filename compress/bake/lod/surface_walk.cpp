#include "compress/bake/lod/surface_walk.h"

#include <algorithm>
#include <cmath>

#include "compress/bake/lod/triangle_distance.h"

namespace packtrace {
namespace {

constexpr int kMostSteps = 32;  // triangles on one way, or around one point
constexpr double kSteep = 0.05; // sine; planes through an edge and a direction nearer to it than that are none

} // namespace

SurfaceWalk::SurfaceWalk(const OverlaySurface& before, const SurfaceSide& after, const SimplifyMesh& mesh)
    : before_(before), after_(after), mesh_(mesh), places_(before.points.size()), ways_(mesh.edge_became.size()),
      side_of_edge_(mesh.edge_became.size(), kNone), neighbours_(3 * mesh.triangles.size(), kNone),
      facing_(mesh.points.size()) {
  if (!mesh.side_edges.empty()) find_neighbours();
  normals_.reserve(mesh.triangles.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const DVec3& normal = normals_.emplace_back(after.surface().area_normal(t));
    for (int i = 0; i < 3; ++i) facing_[corners(t)[i]] += normal;
  }
}

// ---- the surface after

/// Pairs the sides of each edge. Edges of more than two triangles, or of two that face apart, have none.
void SurfaceWalk::find_neighbours() {
  std::vector<uint8_t> sides(ways_.size());
  std::vector<uint32_t> side_opposite(ways_.size());
  for (uint32_t corner = 0; corner < neighbours_.size(); ++corner) {
    const uint32_t edge = mesh_.edge_became[mesh_.side_edges[3 * mesh_.source[corner / 3] + corner % 3]];
    const uint32_t other = side_of_edge_[edge];
    if (sides[edge] == 0) {
      side_of_edge_[edge] = corner, sides[edge] = 1;
    } else if (sides[edge] == 1 && point_at(other) == point_after(corner) && point_after(other) == point_at(corner)) {
      side_opposite[edge] = corner, sides[edge] = 2;
    } else {
      sides[edge] = 3;
    }
  }
  for (size_t edge = 0; edge < sides.size(); ++edge)
    if (const uint32_t a = side_of_edge_[edge], b = side_opposite[edge]; sides[edge] == 2)
      neighbours_[a] = b / 3, neighbours_[b] = a / 3;
}

inline uint32_t SurfaceWalk::across(uint32_t triangle, uint32_t from) const {
  const Triangle& p = corners(triangle);
  return neighbours_[3 * triangle + (p.x == from ? 0 : p.y == from ? 1 : 2)];
}

// ---- ways

bool SurfaceWalk::make_slice(const DVec3& from, const DVec3& to, const DVec3& up, Slice& out) const {
  const DVec3 d = to - from;
  out.from = from, out.to = to;
  out.left = glm::cross(up, d);
  const double left2 = glm::dot(out.left, out.left), up2 = glm::dot(up, up);
  if (!(left2 > kSteep * kSteep * up2 * glm::dot(d, d))) return false;
  out.along = glm::cross(out.left, up) / left2;
  return true;
}

bool SurfaceWalk::leave_point(const Slice& slice, uint32_t from, uint32_t& triangle, Exit& out) const {
  for (const uint32_t t : after_.around(from)) {
    const Triangle& p = corners(t);
    const int corner = p.x == from ? 0 : p.y == from ? 1 : 2;
    out.right = p[(corner + 1) % 3];
    out.side_right = slice.side(point(out.right));
    if (!(out.side_right < 0.0)) continue;
    out.left = p[(corner + 2) % 3];
    out.side_left = slice.side(point(out.left));
    if (out.side_left < 0.0) continue;
    triangle = t;
    return true;
  }
  return false;
}

bool SurfaceWalk::leave_triangle(const Slice& slice, uint32_t triangle, Exit& out) const {
  const Triangle& p = corners(triangle);
  const double sides[3] = {slice.side(point(p.x)), slice.side(point(p.y)), slice.side(point(p.z))};
  for (int i = 0; i < 3; ++i) {
    const int next = (i + 1) % 3;
    if (!(sides[i] < 0.0) || sides[next] < 0.0) continue;
    out = {p[i], p[next], sides[i], sides[next]};
    return true;
  }
  return false;
}

/// Goes through the exit into the next triangle and finds its exit. False at borders.
bool SurfaceWalk::enter(const Slice& slice, uint32_t& triangle, Exit& exit, uint32_t goal_point, bool& reached) const {
  triangle = across(triangle, exit.right);
  if (triangle == kNone) return false;
  const Triangle& p = corners(triangle);
  const uint32_t next = p.x != exit.right && p.x != exit.left ? p.x : p.y != exit.right && p.y != exit.left ? p.y : p.z;
  reached = next == goal_point;
  if (reached) return true;
  const double side = slice.side(point(next));
  if (side < 0.0)
    exit.right = next, exit.side_right = side;
  else
    exit.left = next, exit.side_left = side;
  return true;
}

/// How far on the way the exit is, 0 to 1.
double SurfaceWalk::progress(const Slice& slice, const Exit& exit, DVec3& crossing) const {
  const DVec3 &right = point(exit.right), &left = point(exit.left);
  const double t = exit.side_right / (exit.side_right - exit.side_left);
  crossing = right + t * (left - right);
  return glm::dot(crossing - slice.from, slice.along);
}

const SurfaceWalk::Place& SurfaceWalk::place(uint32_t before) {
  Place& p = places_[before];
  if (p.state == Place::State::kUnknown) find_place(before, p);
  return p;
}

/// From the point that it became as far as it is away from it.
void SurfaceWalk::find_place(uint32_t before, Place& out) {
  const uint32_t became = mesh_.stands_for[before];
  const DVec3 &from = point(became), &to = before_.points[before];
  out.state = Place::State::kPoint, out.number = became, out.at = from;
  if (from == to) return;
  out.state = Place::State::kNowhere;
  const DVec3& up = facing_[became];
  Slice slice;
  Exit exit{};
  uint32_t triangle = kNone;
  if (!make_slice(from, to, up, slice) || !leave_point(slice, became, triangle, exit)) {
    // It is straight above the point.
    const DVec3 d = to - from;
    out.distance2 = glm::dot(d, d);
    if (const DVec3 left = glm::cross(up, d);
        glm::dot(left, left) <= kSteep * kSteep * glm::dot(up, up) * out.distance2)
      out.state = Place::State::kPoint;
    return;
  }
  for (int step = 0; step < kMostSteps; ++step) {
    DVec3 crossing;
    if (progress(slice, exit, crossing) >= 1.0) {
      const DVec3& normal = normals_[triangle];
      const double slope = glm::dot(normal, up), up2 = glm::dot(up, up);
      if (!(slope > 0.0) || slope * slope < kSteep * kSteep * glm::dot(normal, normal) * up2) return;
      const double height = glm::dot(normal, point(corners(triangle).x) - to) / slope;
      out = {Place::State::kTriangle, triangle, to + height * up, height * height * up2};
      return;
    }
    bool reached = false;
    if (!enter(slice, triangle, exit, kNone, reached)) return;
  }
}

const SurfaceWalk::Way& SurfaceWalk::way(uint32_t edge, uint32_t a, uint32_t b) {
  Way& w = ways_[edge];
  if (w.state == Way::State::kUnknown) {
    w.state = Way::State::kNowhere;
    w.first = static_cast<uint32_t>(crossings_.size());
    find_way(edge, std::min(a, b), std::max(a, b), w);
    w.count = static_cast<uint32_t>(crossings_.size()) - w.first;
  }
  return w;
}

/// The edge is still there.
bool SurfaceWalk::find_along(uint32_t edge, uint32_t from, uint32_t to, Way& out) const {
  const uint32_t side = side_of_edge_[mesh_.edge_became[edge]];
  if (side == kNone) return false;
  const bool forward = point_at(side) == from && point_after(side) == to;
  if (!forward && !(point_at(side) == to && point_after(side) == from)) return false;
  (forward ? out.start : out.right) = side / 3;
  (forward ? out.right : out.start) = neighbours_[side];
  out.state = Way::State::kAlong;
  return true;
}

void SurfaceWalk::find_way(uint32_t edge, uint32_t a, uint32_t b, Way& out) {
  const Place &from = place(a), &goal = place(b);
  if (from.state == Place::State::kNowhere || goal.state == Place::State::kNowhere) return;
  const bool at_points = from.state == Place::State::kPoint && goal.state == Place::State::kPoint;
  if (at_points) {
    if (find_along(edge, from.number, goal.number, out)) return;
  } else {
    out.state = Way::State::kAcross;
    out.start = from.state == Place::State::kTriangle ? from.number : goal.number;
    if (from.state == Place::State::kTriangle ? at(from.number, goal) : has(goal.number, from.number)) return;
    out.state = Way::State::kNowhere;
  }
  Slice slice;
  const DVec3 up = facing_[mesh_.stands_for[a]] + facing_[mesh_.stands_for[b]];
  if (!make_slice(before_.points[a], before_.points[b], up, slice)) return;
  Exit exit{};
  uint32_t triangle = from.number;
  if (from.state == Place::State::kPoint ? !leave_point(slice, from.number, triangle, exit)
                                         : !leave_triangle(slice, triangle, exit))
    return;
  out.start = triangle;
  const uint32_t goal_point = goal.state == Place::State::kPoint ? goal.number : kNone;
  double last = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    DVec3 crossing;
    const double on = progress(slice, exit, crossing);
    if (on > 1.0 && step_aside(triangle, goal, slice)) {
      out.state = Way::State::kAcross;
      return;
    }
    last = std::clamp(on, last, 1.0);
    const DVec3 d = crossing - (slice.from + last * (slice.to - slice.from));
    bool reached = false;
    if (!enter(slice, triangle, exit, goal_point, reached)) return;
    crossings_.push_back({triangle, last, crossing, glm::dot(d, d)});
    if (reached || triangle == (goal_point == kNone ? goal.number : kNone)) {
      out.state = Way::State::kAcross;
      return;
    }
  }
}

/// The end lies in the next triangle, hardly beyond one of the other sides.
bool SurfaceWalk::step_aside(uint32_t triangle, const Place& goal, const Slice& slice) {
  const Triangle& p = corners(triangle);
  for (int i = 0; i < 3; ++i) {
    const uint32_t next = across(triangle, p[i]);
    if (next == kNone || !at(next, goal)) continue;
    const DVec3 crossing = nearest_point(slice.to, point(p[i]), point(p[(i + 1) % 3])), d = slice.to - crossing;
    crossings_.push_back({next, 1.0, crossing, glm::dot(d, d)});
    return true;
  }
  return false;
}

// ---- triangles

/// The largest distance, squared, of a point of the outline and its image, which `triangle` has.
template <SurfaceWalk::Look look>
inline double SurfaceWalk::distance2(Outline& outline, uint32_t triangle, const DVec3& before, const DVec3& after,
                                     double of_both) const {
  if constexpr (look == Look::kShares) outline.points[outline.point_count++] = after;
  if constexpr (look != Look::kCloser) return of_both;
  if (of_both == 0.0) return 0.0;
  const Triangle& t = corners(triangle);
  const DVec3 there = before - nearest_point(before, point(t.x), point(t.y), point(t.z));
  const DVec3 back = after - nearest_point(after, outline.corners[0], outline.corners[1], outline.corners[2]);
  return std::min(of_both, std::max(glm::dot(there, there), glm::dot(back, back)));
}

/// The image of the outline, triangle by triangle. False where it is too long.
template <SurfaceWalk::Look look>
bool SurfaceWalk::follow(Outline& outline, const Triangle& p, const uint32_t* edges, const uint32_t* starts) {
  const Place& begin = places_[p.x];
  outline.count = 0, outline.point_count = 0;
  Interval last{starts[0], 0, 0.0};
  last.distance2 = distance2<look>(outline, last.triangle, outline.corners[0], begin.at, begin.distance2);
  for (int side = 0; side < 3; ++side) {
    const int next = (side + 1) % 3;
    const uint32_t a = p[side], b = p[next];
    const Way& w = ways_[edges[side]];
    const uint32_t count = w.state == Way::State::kAlong ? 0 : w.count;
    if (outline.count + count + 2 > Outline::kMost) return false;
    for (uint32_t k = 0; k < count; ++k) {
      const Crossing* c = &crossings_[w.first + (a < b ? k : count - 1 - k)];
      const uint32_t into = a < b ? c->into : k + 1 == count ? w.start : c[-1].into;
      DVec3 before(0.0);
      if constexpr (look == Look::kCloser) {
        const DVec3 &low = before_.points[std::min(a, b)], &high = before_.points[std::max(a, b)];
        before = low + c->on * (high - low);
      }
      const double leaves = distance2<look>(outline, last.triangle, before, c->at, c->distance2);
      outline.intervals[outline.count++] = {last.triangle, last.first_point, std::max(last.distance2, leaves)};
      last = {into, outline.point_count, 0.0};
      last.distance2 = distance2<look>(outline, into, before, c->at, c->distance2);
    }
    const Place& end = places_[b];
    const DVec3& corner = outline.corners[static_cast<size_t>(next)];
    last.distance2 = std::max(last.distance2, distance2<look>(outline, last.triangle, corner, end.at, end.distance2));
    if (end.state != Place::State::kPoint) continue;
    // Around a corner that is a point after, inside the triangle before.
    while (last.triangle != starts[next]) {
      const uint32_t turned = across(last.triangle, end.number);
      if (turned == kNone || outline.count + 2 > Outline::kMost) return false;
      outline.intervals[outline.count++] = last;
      last = {turned, outline.point_count, 0.0};
      last.distance2 = distance2<look>(outline, turned, corner, end.at, end.distance2);
    }
  }
  outline.intervals[outline.count++] = last;
  return true;
}

/// Whether the outline's image bounds a disk around one point at most. First what it goes into and comes back from is
/// cut off: both ends of a straight cut lie in both triangles. What then is left of it goes around a point.
/// @param inside set to that point, or kNone
bool SurfaceWalk::contract(const Outline& outline, uint32_t& inside) {
  std::array<uint32_t, Outline::kMost> word;
  size_t begin = 0, end = 0;
  for (uint32_t i = 0; i < outline.count; ++i) {
    const uint32_t t = outline.intervals[i].triangle;
    if (end >= 1 && word[end - 1] == t) continue;
    if (end >= 2 && word[end - 2] == t)
      --end;
    else
      word[end++] = t;
  }
  for (bool changed = true; changed && end - begin > 2;) {
    changed = true;
    if (word[begin] == word[end - 1])
      --end;
    else if (word[begin] == word[end - 2])
      end -= 2;
    else if (word[begin + 1] == word[end - 1])
      begin += 2;
    else
      changed = false;
  }
  inside = kNone;
  if (end - begin <= 2) return true;
  const Triangle& first = corners(word[begin]);
  for (int i = 0; i < 3; ++i) {
    if (!std::all_of(word.begin() + begin, word.begin() + end, [&](uint32_t t) { return has(t, first[i]); })) continue;
    inside = first[i];
    return true;
  }
  return false;
}

/// What an interval contributes to the area of the image in its triangle, times twice that triangle's area.
/// @param reference the point inside, if there is one, else any point
double SurfaceWalk::area(const Outline& outline, uint32_t interval, const DVec3& reference) const {
  const auto at = [&](uint32_t i) -> const Interval& { return outline.intervals[i % outline.count]; };
  const auto end_of = [&](uint32_t i) { return i + 1 < outline.count ? at(i + 1).first_point : outline.point_count; };
  const uint32_t triangle = at(interval).triangle, end = end_of(interval);
  DVec3 sum(0.0);
  for (uint32_t i = at(interval).first_point; i + 1 < end; ++i)
    sum += glm::cross(outline.points[i] - reference, outline.points[i + 1] - reference);
  uint32_t next = interval + 1;
  while (at(next).triangle != triangle) ++next;
  // Back through the side where it left: straight along it.
  if (next == interval + 1 || at(interval + 1).triangle == at(next - 1).triangle)
    sum += glm::cross(outline.points[end - 1] - reference, outline.points[at(next).first_point] - reference);
  return glm::dot(sum, normals_[triangle]);
}

template <SurfaceWalk::Look look>
bool SurfaceWalk::lay(uint32_t triangle, std::vector<OverlayPiece>& pieces) {
  if (3 * size_t{triangle} >= mesh_.side_edges.size()) return false;
  const Triangle& p = before_.triangles[triangle].points;
  const uint32_t* edges = &mesh_.side_edges[3 * size_t{triangle}];
  uint32_t starts[3];
  for (int i = 0; i < 3; ++i) {
    const uint32_t a = p[i], b = p[(i + 1) % 3];
    const Way& w = way(edges[i], a, b);
    if (w.state == Way::State::kNowhere) return false;
    if (a < b)
      starts[i] = w.start;
    else if (w.state == Way::State::kAlong)
      starts[i] = w.right;
    else
      starts[i] = w.count == 0 ? w.start : crossings_[w.first + w.count - 1].into;
    if (starts[i] == kNone) return false;
  }
  Outline& outline = outline_;
  for (int i = 0; i < 3; ++i) outline.corners[static_cast<size_t>(i)] = before_.points[p[i]];
  if (!follow<look>(outline, p, edges, starts)) return false;
  uint32_t inside = kNone;
  if (outline.count > 2 && !contract(outline, inside)) return false;
  DVec3 reference = outline.corners[0];
  double inside2 = 0.0;
  if (inside != kNone) {
    reference = point(inside);
    const DVec3 d = reference - nearest_point(reference, outline.corners[0], outline.corners[1], outline.corners[2]);
    inside2 = glm::dot(d, d);
  }
  const size_t first = pieces.size();
  pieces.resize(first + outline.count);
  for (uint32_t i = 0; i < outline.count; ++i) {
    const Interval& part = outline.intervals[i];
    pieces[first + i] = {part.triangle, std::sqrt(std::max(part.distance2, inside2)), 0.0};
    if constexpr (look == Look::kShares) {
      const DVec3& n = normals_[part.triangle];
      pieces[first + i].share = area(outline, i, reference) / glm::dot(n, n);
    }
  }
  return true;
}

bool SurfaceWalk::lay(uint32_t triangle, Look look, std::vector<OverlayPiece>& pieces) {
  switch (look) {
  case Look::kCloser:
    return lay<Look::kCloser>(triangle, pieces);
  case Look::kShares:
    return lay<Look::kShares>(triangle, pieces);
  default:
    return lay<Look::kAtImages>(triangle, pieces);
  }
}

void SurfaceWalk::find_borders(std::span<const uint8_t> mapped, std::span<uint8_t> covered) {
  std::vector<int32_t> balance(ways_.size());
  for (uint32_t t = 0; 3 * size_t{t} < mesh_.side_edges.size(); ++t) {
    if (mapped[t] == 0) continue;
    const Triangle& p = before_.triangles[t].points;
    for (uint32_t i = 0; i < 3; ++i)
      balance[mesh_.side_edges[3 * t + i]] += p[static_cast<int>(i)] < p[static_cast<int>((i + 1) % 3)] ? 1 : -1;
  }
  for (uint32_t e = 0; e < ways_.size(); ++e) {
    const Way& w = ways_[e];
    if (balance[e] == 0 || w.state != Way::State::kAcross) continue;
    covered[w.start] = 0;
    for (uint32_t k = 0; k < w.count; ++k) covered[crossings_[w.first + k].into] = 0;
  }
}

} // namespace packtrace
