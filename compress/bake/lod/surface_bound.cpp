#include "compress/bake/lod/surface_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "compress/bake/lod/triangle_distance.h"

namespace packtrace {
namespace {

constexpr double kCovered = 1e-6;    // of a triangle's area may be left over: roundings
constexpr double kSeen = 0.02;       // of a new triangle's area may be met by no old one, between their directions
constexpr int kMaxCuts = 5;          // how often a triangle is cut in four where no other way is left
constexpr double kGoodEnough = 1.25; // then: of what cutting could still gain
constexpr size_t kLargeFan = 48;     // triangles around a point
constexpr double kSteep = 0.05;      // cosine; what is steeper is not seen from there
constexpr double kInflation = 1.001; // of what was measured, for all roundings
constexpr size_t kMaxCorners = 8;    // of a triangle cut by three lines: six

struct Point2 {
  double x, y;
};

/// A convex polygon in a triangle's plane.
struct Polygon {
  std::array<Point2, kMaxCorners> corners;
  size_t count;
};

/// A part of a triangle before that lies over one after.
struct Piece {
  Polygon polygon;
  uint32_t after;
  double seen; ///< its share of the latter's area
};

/// Part of a triangle before is within `distance` of one after.
struct Bound {
  uint32_t after;
  double distance;
};

double cross(Point2 a, Point2 b, Point2 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// Keeps what lies to the left of a -> b.
void cut(Polygon& polygon, Point2 a, Point2 b) {
  const Polygon in = polygon;
  polygon.count = 0;
  Point2 p = in.corners[in.count - 1];
  double last = cross(a, b, p);
  for (size_t i = 0; i < in.count; ++i) {
    const Point2 q = in.corners[i];
    const double next = cross(a, b, q);
    if ((last < 0.0) != (next < 0.0)) {
      const double t = last / (last - next);
      polygon.corners[polygon.count++] = {p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)};
    }
    if (next >= 0.0) polygon.corners[polygon.count++] = q;
    p = q, last = next;
  }
}

double area2(const Polygon& p) {
  double sum = 0.0;
  for (size_t i = 2; i < p.count; ++i) sum += cross(p.corners[0], p.corners[i - 1], p.corners[i]);
  return sum;
}

/// Lists of triangles around points.
class Fans {
public:
  template <typename PointOf>
  Fans(size_t points, std::span<const LodTriangle> triangles, const PointOf& point_of) : first_(points + 1) {
    const auto for_each = [&](const auto& visit) {
      for (uint32_t i = 0; i < triangles.size(); ++i) {
        const Triangle t(point_of(triangles[i].points.x), point_of(triangles[i].points.y),
                         point_of(triangles[i].points.z));
        visit(t.x, i);
        if (t.y != t.x) visit(t.y, i);
        if (t.z != t.x && t.z != t.y) visit(t.z, i);
      }
    };
    for_each([&](uint32_t p, uint32_t) { ++first_[p + 1]; });
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    triangles_.resize(first_.back());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for_each([&](uint32_t p, uint32_t i) { triangles_[next[p]++] = i; });
  }
  std::span<const uint32_t> of(uint32_t point) const {
    return std::span(triangles_).subspan(first_[point], first_[point + 1] - first_[point]);
  }

private:
  std::vector<uint32_t> first_, triangles_;
};

class Measurer {
public:
  Measurer(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh)
      : points_(points), before_(triangles), m_(mesh), after_(mesh.triangles), stamp_(after_.size()),
        seen_(after_.size()), fans_(mesh.points.size(), after_, [](uint32_t p) { return p; }),
        old_fans_(mesh.points.size(), before_, [&](uint32_t p) { return mesh.stands_for[p]; }) {}

  void run() {
    errors_.assign(after_.size(), 0.0);
    for (uint32_t s = 0; s < after_.size(); ++s)
      normals_.push_back(glm::cross(corner_after(s, 1) - corner_after(s, 0), corner_after(s, 2) - corner_after(s, 0)));
    flat_.resize(m_.points.size());
    flat_stamp_.resize(m_.points.size());
    measure_moved_points();
    for (const LodTriangle& t : before_) measure_before(t);
    for (uint32_t i = 0; i < after_.size(); ++i) measure_after(i);
    for (size_t i = 0; i < after_.size(); ++i) m_.triangles[i].error = errors_[i];
  }

private:
  DVec3 corner_after(uint32_t triangle, int i) const { return m_.points[after_[triangle].points[i]]; }

  void note(uint32_t triangle, double distance, double had) {
    errors_[triangle] = std::max(errors_[triangle], distance * kInflation + had);
  }

  /// The triangles after around the points that these became.
  void find_candidates(const Triangle& points) {
    candidates_.clear();
    ++stamp_value_;
    const Triangle corners(m_.stands_for[points.x], m_.stands_for[points.y], m_.stands_for[points.z]);
    for (int i = 0; i < 3; ++i) add_candidates(near_fan(fans_, after_, corners, i, [](uint32_t p) { return p; }));
  }
  void add_candidates(std::span<const uint32_t> triangles) {
    for (const uint32_t t : triangles)
      if (stamp_[t] != stamp_value_) stamp_[t] = stamp_value_, candidates_.push_back(t);
  }
  /// One ring more.
  void widen_candidates() {
    const size_t count = candidates_.size();
    for (size_t i = 0; i < count; ++i)
      for (int k = 0; k < 3; ++k)
        if (const auto fan = fans_.of(after_[candidates_[i]].points[k]); fan.size() <= kLargeFan) add_candidates(fan);
  }

  /// The triangles around a corner; where there are very many, those that have another of the corners too, or else a
  /// few.
  template <typename PointOf>
  std::span<const uint32_t> near_fan(const Fans& fans, std::span<const LodTriangle> triangles, const Triangle& corners,
                                     int corner, const PointOf& point_of) {
    const std::span<const uint32_t> fan = fans.of(corners[corner]);
    if (fan.size() <= kLargeFan) return fan;
    fan_.clear();
    for (const uint32_t t : fan)
      for (int i = 0; i < 3; ++i) {
        const uint32_t p = point_of(triangles[t].points[i]);
        if (p != corners[corner] && (p == corners.x || p == corners.y || p == corners.z)) {
          fan_.push_back(t);
          break;
        }
      }
    if (fan_.empty()) return fan.first(kLargeFan);
    return std::span<const uint32_t>(fan_).first(std::min(fan_.size(), kLargeFan));
  }

  void measure_before(const LodTriangle& t) {
    find_candidates(t.points);
    if (candidates_.empty()) // all that its corners became part of is gone: then anything may be the nearest
      for (uint32_t s = 0; s < after_.size(); ++s) candidates_.push_back(s);
    if (is_unchanged(t)) return;
    const std::array<DVec3, 3> p = {points_[t.points.x], points_[t.points.y], points_[t.points.z]};
    best_.clear();
    best_bound_ = std::numeric_limits<double>::infinity();
    lay_over(p, glm::cross(p[1] - p[0], p[2] - p[0]));
    if (best_bound_ > floor_) try_harder(p);
    for (const Bound& bound : best_) note(bound.after, bound.distance, t.error);
  }

  /// Whether the triangle is there as it was; then that is noted.
  bool is_unchanged(const LodTriangle& t) {
    for (int i = 0; i < 3; ++i)
      if (m_.stands_for[t.points[i]] != t.points[i] || m_.moved[t.points[i]] != 0) return false;
    for (const uint32_t s : candidates_)
      if (const Triangle& p = after_[s].points; p == t.points || p == Triangle(t.points.y, t.points.z, t.points.x) ||
                                                p == Triangle(t.points.z, t.points.x, t.points.y)) {
        note(s, 0.0, t.error);
        seen_[s] += glm::length(normals_[s]);
        return true;
      }
    return false;
  }

  /// Seen from where the new surface faces, slivers and small dents lie flatter; and it may reach further.
  void try_harder(const std::array<DVec3, 3>& p) {
    DVec3 facing(0.0);
    for (const uint32_t s : candidates_) facing += normals_[s];
    widen_candidates();
    lay_over(p, facing);
    if (best_bound_ <= floor_) return;
    double least = 0.0; // what it cannot be below, as far as the candidates go
    for (const DVec3& corner : p) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const uint32_t s : candidates_) nearest = std::min(nearest, distance(corner, s));
      if (!candidates_.empty()) least = std::max(least, nearest);
    }
    floor_ = std::max(floor_, least);
    if (best_bound_ <= floor_) return;
    std::vector<Bound> bounds;
    double largest = 0.0;
    refine(
        p, kMaxCuts, candidates_, [&](DVec3 q, uint32_t after) { return distance(q, after); },
        [&](uint32_t after, double d) {
          bounds.push_back({after, d}), largest = std::max(largest, d);
        });
    if (largest < best_bound_) best_ = std::move(bounds), best_bound_ = largest;
  }

  struct Frame {
    DVec3 origin, x, y, z;
    Point2 flat(DVec3 p) const { return {glm::dot(p - origin, x), glm::dot(p - origin, y)}; }
  };

  /// Cuts the triangle by the outlines of the candidates, all seen along `direction`, and measures the pieces. Becomes
  /// the best bound if it is one: where they cover the triangle once.
  void lay_over(const std::array<DVec3, 3>& t, DVec3 direction) {
    const double length = glm::length(direction);
    if (!(length > 0.0)) return;
    const DVec3 z = direction / length;
    const DVec3 across = std::abs(z.x) < 0.6 ? DVec3(0.0, -z.z, z.y) : DVec3(-z.z, 0.0, z.x);
    const DVec3 x = glm::normalize(across);
    const Frame frame{t[0], x, glm::cross(z, x), z};
    Polygon whole;
    whole.count = 3;
    for (size_t i = 0; i < 3; ++i) whole.corners[i] = frame.flat(t[i]);
    if (area2(whole) < 0.0) std::swap(whole.corners[1], whole.corners[2]);
    const double area = area2(whole);
    const DVec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    if (!(area > kSteep * glm::length(normal))) return;
    pieces_.clear();
    ++flat_stamp_value_;
    double covered = 0.0;
    for (size_t i = 0; i < candidates_.size() && covered < area * (1.0 - kCovered); ++i)
      covered += lay_one_over(whole, frame, candidates_[i]);
    if (covered < area * (1.0 - kCovered) || covered > area * (1.0 + kCovered)) return;
    const DVec3 slope = normal / glm::dot(normal, z); // height of the triangle above the frame's plane: -slope
    bounds_.clear();
    double largest = 0.0;
    for (const Piece& piece : pieces_) {
      bounds_.push_back({piece.after, piece_distance(piece, frame, slope)});
      largest = std::max(largest, bounds_.back().distance);
    }
    if (largest < best_bound_) best_.swap(bounds_), best_bound_ = largest;
  }

  Point2 flat_after(const Frame& frame, uint32_t point) {
    if (flat_stamp_[point] != flat_stamp_value_)
      flat_stamp_[point] = flat_stamp_value_, flat_[point] = frame.flat(m_.points[point]);
    return flat_[point];
  }

  /// Twice the area that the candidate covers.
  double lay_one_over(const Polygon& whole, const Frame& frame, uint32_t s) {
    const Triangle& points = after_[s].points;
    const std::array<Point2, 3> f = {flat_after(frame, points.x), flat_after(frame, points.y),
                                     flat_after(frame, points.z)};
    const double facing = cross(f[0], f[1], f[2]);
    if (!(facing > 0.0)) return 0.0;
    // Mostly a side of one of them separates them.
    std::array<bool, 3> cuts{};
    for (size_t k = 0; k < 3; ++k) {
      const Point2 &p = f[k], &q = f[(k + 1) % 3];
      const double d0 = cross(p, q, whole.corners[0]), d1 = cross(p, q, whole.corners[1]),
                   d2 = cross(p, q, whole.corners[2]);
      if (std::max({d0, d1, d2}) <= 0.0) return 0.0;
      cuts[k] = std::min({d0, d1, d2}) < 0.0;
      const Point2 &r = whole.corners[k], &t = whole.corners[(k + 1) % 3];
      if (std::max({cross(r, t, f[0]), cross(r, t, f[1]), cross(r, t, f[2])}) <= 0.0) return 0.0;
    }
    Piece& piece = pieces_.emplace_back();
    piece.polygon = whole;
    piece.after = s;
    for (size_t k = 0; k < 3 && piece.polygon.count >= 3; ++k)
      if (cuts[k]) cut(piece.polygon, f[k], f[(k + 1) % 3]);
    const double size = piece.polygon.count < 3 ? 0.0 : area2(piece.polygon);
    if (!(size > 0.0)) {
      pieces_.pop_back();
      return 0.0;
    }
    piece.seen = size / facing;
    return size;
  }

  /// The largest distance of the piece from the triangle that it lies under.
  double piece_distance(const Piece& piece, const Frame& frame, DVec3 slope) {
    const uint32_t s = piece.after;
    const DVec3 a = corner_after(s, 0);
    const DVec3& normal = normals_[s];
    seen_[s] += piece.seen * glm::length(normal);
    const double nz = glm::dot(normal, frame.z);
    std::array<DVec3, kMaxCorners> corners;
    double straight = 0.0;
    for (size_t i = 0; i < piece.polygon.count; ++i) {
      const DVec3 flat = piece.polygon.corners[i].x * frame.x + piece.polygon.corners[i].y * frame.y;
      corners[i] = frame.origin + flat - glm::dot(flat, slope) * frame.z;
      straight = std::max(straight, std::abs(glm::dot(a - corners[i], normal) / nz));
    }
    if (straight <= floor_) return straight;
    // Straight up may be far where the surface is steep; the nearest point is what counts.
    double nearest = 0.0;
    for (size_t i = 0; i < piece.polygon.count; ++i) nearest = std::max(nearest, distance(corners[i], s));
    return std::min(straight, nearest);
  }

  double distance(DVec3 p, uint32_t after) const {
    return glm::length(p - nearest_point(p, corner_after(after, 0), corner_after(after, 1), corner_after(after, 2)));
  }

  /// Bounds the distance of a triangle from the nearest of several, cutting it as long as that makes the bound much
  /// smaller: the distance from one triangle is convex, so the three corners bound it for all of it.
  /// @param among numbers that distance_to understands
  template <typename DistanceTo, typename Noted>
  void refine(const std::array<DVec3, 3>& t, int cuts, std::span<const uint32_t> among, const DistanceTo& distance_to,
              const Noted& noted) {
    double best = std::numeric_limits<double>::infinity();
    std::array<double, 3> nearest{best, best, best};
    uint32_t where = 0;
    for (const uint32_t number : among) {
      double largest = 0.0;
      for (size_t k = 0; k < 3; ++k) {
        const double d = distance_to(t[k], number);
        nearest[k] = std::min(nearest[k], d), largest = std::max(largest, d);
      }
      if (largest < best) best = largest, where = number;
    }
    if (among.empty()) return;
    const double enough = std::max(kGoodEnough * std::max({nearest[0], nearest[1], nearest[2]}), floor_);
    if (cuts == 0 || best <= enough) {
      noted(where, best);
      return;
    }
    // What is too far from all of it serves none of its parts.
    const DVec3 center = (t[0] + t[1] + t[2]) / 3.0;
    const double radius =
        std::max({glm::length(t[0] - center), glm::length(t[1] - center), glm::length(t[2] - center)});
    std::vector<uint32_t> kept;
    for (const uint32_t number : among)
      if (number == where || distance_to(center, number) <= radius + enough) kept.push_back(number);
    const DVec3 ab = 0.5 * (t[0] + t[1]), bc = 0.5 * (t[1] + t[2]), ca = 0.5 * (t[2] + t[0]);
    for (const auto& part :
         {std::array{t[0], ab, ca}, std::array{ab, t[1], bc}, std::array{ca, bc, t[2]}, std::array{ab, bc, ca}})
      refine(part, cuts - 1, kept, distance_to, noted);
  }

  /// Where the new surface has points of its own.
  void measure_moved_points() {
    for (uint32_t p = 0; p < m_.points.size(); ++p) {
      if (m_.moved[p] == 0 || fans_.of(p).empty()) continue;
      const auto [distance, had] = nearest_before(m_.points[p], old_fans_.of(p));
      floor_ = std::max(floor_, distance);
      for (const uint32_t s : fans_.of(p)) note(s, distance, had);
    }
  }

  struct Near {
    double distance, had;
  };
  Near nearest_before(DVec3 p, std::span<const uint32_t> among) const {
    Near best{std::numeric_limits<double>::infinity(), 0.0};
    for (const uint32_t i : among) {
      const Triangle& t = before_[i].points;
      const double d = glm::length(p - nearest_point(p, points_[t.x], points_[t.y], points_[t.z]));
      if (d < best.distance) best = {d, before_[i].error};
    }
    return best;
  }

  /// A triangle after of which the ones before saw too little: it is measured itself.
  void measure_after(uint32_t s) {
    const DVec3 a = corner_after(s, 0), b = corner_after(s, 1), c = corner_after(s, 2);
    const double area = glm::length(normals_[s]);
    if (seen_[s] >= area * (1.0 - kSeen)) return;
    std::vector<uint32_t> near;
    const auto stands_for = [&](uint32_t p) { return m_.stands_for[p]; };
    for (int i = 0; i < 3; ++i)
      for (const uint32_t t : near_fan(old_fans_, before_, after_[s].points, i, stands_for)) near.push_back(t);
    refine(
        {a, b, c}, kMaxCuts, near,
        [&](DVec3 p, uint32_t before) {
          const Triangle& t = before_[before].points;
          return glm::length(p - nearest_point(p, points_[t.x], points_[t.y], points_[t.z]));
        },
        [&](uint32_t before, double distance) { note(s, distance, before_[before].error); });
  }

  std::span<const DVec3> points_;
  std::span<const LodTriangle> before_;
  SimplifyMesh& m_;
  std::span<const LodTriangle> after_;
  std::vector<uint32_t> stamp_, candidates_, fan_;
  std::vector<double> seen_; ///< area of each triangle after that was met, times 2
  std::vector<double> errors_;
  std::vector<DVec3> normals_; ///< of triangles after, twice their area long
  std::vector<Point2> flat_;   ///< points after in the plane at hand, where flat_stamp_ says so
  std::vector<uint32_t> flat_stamp_;
  uint32_t flat_stamp_value_ = 0;
  Fans fans_, old_fans_;
  uint32_t stamp_value_ = 0;
  std::vector<Piece> pieces_;
  std::vector<Bound> bounds_, best_; ///< of the triangle at hand
  double best_bound_ = 0.0;
  double floor_ = 0.5; ///< some distance is at least this (or it is half a step): bounds below need no work
};

} // namespace

void bound_errors(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh) {
  Measurer(points, triangles, mesh).run();
}

} // namespace packtrace
