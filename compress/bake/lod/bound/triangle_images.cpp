#include "compress/bake/lod/bound/triangle_images.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compress/bake/lod/bound/triangle_distance.h"

namespace packtrace {
namespace {

using Place = SurfaceWalk::Place;
using EdgePath = SurfaceWalk::EdgePath;

} // namespace

/// Follows the image of the outline through simplified triangles. Returns false if part of it is missing or it is too
/// long.
/// @param visitor called in order: begin(triangle), corner(0), cross(crossing, into) ..., corner(1), ..., corner(0)
/// again; turn(triangle, i) where the outline turns around corner i into another triangle
template <typename Visitor>
bool TriangleImages::follow(uint32_t triangle, Visitor& visitor) {
  const Triangle& p = points(triangle);
  const uint32_t* edge = edges(triangle);
  const EdgePath* ways[3];
  uint32_t starts[3];
  for (int i = 0; i < 3; ++i) {
    const uint32_t a = p[i], b = p[i == 2 ? 0 : i + 1];
    const EdgePath& w = walk_.way(edge[i], a, b);
    if (w.state == EdgePath::State::kNowhere) return false;
    ways[i] = &w;
    if (a < b || (w.state == EdgePath::State::kAcross && w.count == 0))
      starts[i] = w.start;
    else
      starts[i] = w.state == EdgePath::State::kAlong ? w.right : walk_.into(w.first + w.count - 1);
    if (starts[i] == kNone) return false;
  }
  uint32_t steps = 1, last = starts[0];
  visitor.begin(last);
  visitor.corner(0);
  for (int side = 0; side < 3; ++side) {
    const int next = side == 2 ? 0 : side + 1;
    const EdgePath& w = *ways[side];
    if (steps + w.count + 1 > kMax) return false;
    steps += w.count;
    if (p[side] < p[next])
      for (uint32_t k = 0; k < w.count; ++k) visitor.cross(w.first + k, last = walk_.into(w.first + k));
    else
      for (uint32_t k = w.count; k-- > 0;)
        visitor.cross(w.first + k, last = k == 0 ? w.start : walk_.into(w.first + k - 1));
    visitor.corner(next);
    const Place& end = walk_.place(p[next]);
    if (end.state != Place::State::kPoint) continue;
    // If the corner's image is a simplified point, turns around it, inside the source triangle, to the start of the
    // next side.
    while (last != starts[next]) {
      last = walk_.across(last, end.number);
      if (last == kNone || ++steps == kMax) return false;
      visitor.turn(last, next);
    }
  }
  return true;
}

/// Whether the image of the outline bounds a disk with at most one simplified point inside. Detours into a triangle and
/// back are removed first: the straight cut there has both ends in both triangles. The remaining triangles must form a
/// fan.
/// @param inside set to the interior point, or kNone
bool TriangleImages::contract(std::span<const uint32_t> outline, uint32_t& inside) const {
  std::array<uint32_t, kMax> word;
  size_t begin = 0, end = 0;
  for (const uint32_t t : outline) {
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
  for (uint32_t i = 0; i < 3; ++i) {
    const uint32_t point = walk_.point_at(4 * word[begin] + i);
    size_t k = begin + 1;
    while (k < end && walk_.has(word[k], point)) ++k;
    if (k < end) continue;
    inside = point;
    return true;
  }
  return false;
}

double TriangleImages::distance2_from(uint32_t triangle, const DVec3& point) const {
  const OverlaySurface& source = walk_.source();
  const DVec3 d =
      point - nearest_point(point, source.corner(triangle, 0), source.corner(triangle, 1), source.corner(triangle, 2));
  return glm::dot(d, d);
}

bool TriangleImages::find(uint32_t triangle, Image& out) {
  if (3 * size_t{triangle} >= mesh_.side_edges.size()) return false;
  if (met_count_ + kMax > met_.size()) met_.resize(2 * met_.size());
  struct Collector {
    uint32_t* triangles;
    uint32_t count = 0;
    void begin(uint32_t t) { triangles[count++] = t; }
    void cross(uint32_t, uint32_t t) { begin(t); }
    void corner(int) {}
    void turn(uint32_t t, int) { begin(t); }
  } outline{&met_[met_count_]};
  uint32_t inside = kNone;
  if (!follow(triangle, outline)) return false;
  if (outline.count > 2 && !contract({outline.triangles, outline.count}, inside)) return false;
  const Triangle& p = points(triangle);
  const uint32_t* edge = edges(triangle);
  double distance2 = 0.0, inside2 = 0.0;
  for (int i = 0; i < 3; ++i)
    distance2 = std::max(distance2, std::max(walk_.ways()[edge[i]].distance2, walk_.place(p[i]).distance2));
  if (inside != kNone) inside2 = distance2_from(triangle, walk_.point(inside));
  uint32_t different = 0;
  for (uint32_t i = 0; i < outline.count; ++i) {
    const uint32_t met = outline.triangles[i];
    outline.triangles[different] = met;
    different += std::exchange(last_met_[met], triangle) != triangle;
  }
  out = {std::sqrt(std::max(distance2, inside2)), std::sqrt(inside2), met_count_, different, inside};
  met_count_ += different;
  return true;
}

void TriangleImages::look_closer(uint32_t triangle, const Image& image, std::vector<Piece>& pieces) {
  struct Measurer {
    TriangleImages& images;
    uint32_t source;
    Word word;
    std::array<double, kMax> there2, back2;
    DVec3 point; ///< last position on the source outline; `image` is its image
    DVec3 image;
    double of_both;

    void begin(uint32_t simplified) {
      word.triangles[word.count] = simplified;
      there2[word.count] = back2[word.count] = 0.0;
      ++word.count;
    }
    /// Accounts for the last position in the current simplified triangle.
    void measure() {
      const Triangle& t = images.mesh_.triangles[word.triangles[word.count - 1]].points;
      const SurfaceWalk& walk = images.walk_;
      const DVec3 d = point - nearest_point(point, walk.point(t.x), walk.point(t.y), walk.point(t.z));
      double &there = there2[word.count - 1], &back = back2[word.count - 1];
      there = std::max(there, std::min(of_both, glm::dot(d, d)));
      back = std::max(back, std::min(of_both, images.distance2_from(source, image)));
    }
    void take_place(int i) {
      const uint32_t number = images.points(source)[i];
      const Place& place = images.walk_.place(number);
      point = images.walk_.source().points[number], image = place.at, of_both = place.distance2;
    }
    void corner(int i) {
      take_place(i);
      measure();
    }
    void turn(uint32_t simplified, int i) {
      take_place(i);
      begin(simplified);
      measure();
    }
    void cross(uint32_t crossing, uint32_t into) {
      const SurfaceWalk::Crossing& c = images.walk_.crossing(crossing);
      const Triangle& p = images.points(source);
      const uint32_t* edge = images.edges(source);
      int side = 0; // the side whose path has the crossing
      for (; side < 2; ++side)
        if (const EdgePath& w = images.walk_.ways()[edge[side]]; crossing - w.first < w.count) break;
      const uint32_t a = p[side], b = p[side == 2 ? 0 : side + 1];
      const DVec3 &low = images.walk_.source().points[std::min(a, b)],
                  &high = images.walk_.source().points[std::max(a, b)];
      point = low + c.on * (high - low), image = c.point(), of_both = c.distance2;
      measure();
      begin(into);
      measure();
    }
  } outline{*this, triangle, {}, {}, {}, {}, {}, 0.0};
  follow(triangle, outline);
  const double inside2 = image.point == kNone ? 0.0 : distance2_from(triangle, walk_.point(image.point));
  for (uint32_t i = 0; i < outline.word.count; ++i)
    pieces.push_back({outline.word.triangles[i], std::sqrt(std::max(outline.there2[i], inside2)),
                      std::sqrt(std::max(outline.back2[i], inside2))});
}

/// The interval's contribution to the signed area of the image in its triangle, as (twice that area) x (twice the
/// triangle's area).
/// @param reference the interior point if there is one, otherwise any point
double TriangleImages::area(uint32_t interval, const DVec3& reference) const {
  const auto count = static_cast<uint32_t>(outline_.intervals.size() - 1);
  const auto at = [&](uint32_t i) -> const Interval& { return outline_.intervals[i % count]; };
  const uint32_t triangle = at(interval).triangle, end = outline_.intervals[interval + 1].first_point;
  DVec3 sum(0.0);
  for (uint32_t i = at(interval).first_point; i + 1 < end; ++i)
    sum += glm::cross(outline_.points[i] - reference, outline_.points[i + 1] - reference);
  uint32_t next = interval + 1;
  while (at(next).triangle != triangle) ++next;
  // The outline returns through the side where it left: closes the interval along that side.
  if (next == interval + 1 || at(interval + 1).triangle == at(next - 1).triangle)
    sum += glm::cross(outline_.points[end - 1] - reference, outline_.points[at(next).first_point] - reference);
  return glm::dot(sum, walk_.area_normal(triangle));
}

void TriangleImages::add_shares(uint32_t triangle, const Image& image, std::span<const uint8_t> wanted,
                                std::span<double> shares) {
  struct Collector {
    TriangleImages& images;
    uint32_t source;
    void begin(uint32_t simplified) {
      images.outline_.intervals.push_back({simplified, static_cast<uint32_t>(images.outline_.points.size())});
    }
    void add(const DVec3& point) { images.outline_.points.push_back(point); }
    void corner(int i) { add(images.walk_.place(images.points(source)[i]).at); }
    void turn(uint32_t simplified, int i) {
      begin(simplified);
      corner(i);
    }
    void cross(uint32_t crossing, uint32_t into) {
      add(images.walk_.crossing(crossing).point());
      begin(into);
      add(images.walk_.crossing(crossing).point());
    }
  } collector{*this, triangle};
  outline_.intervals.clear(), outline_.points.clear();
  follow(triangle, collector);
  const auto count = static_cast<uint32_t>(outline_.intervals.size());
  outline_.intervals.push_back({kNone, static_cast<uint32_t>(outline_.points.size())});
  const DVec3 reference = image.point == kNone ? outline_.points[0] : walk_.point(image.point);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t s = outline_.intervals[i].triangle;
    if (wanted[s] == 0) continue;
    const DVec3& n = walk_.area_normal(s);
    shares[s] += area(i, reference) / glm::dot(n, n);
  }
}

} // namespace packtrace
