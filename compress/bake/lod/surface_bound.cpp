#include "compress/bake/lod/surface_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "compress/bake/lod/surface_side.h"
#include "compress/bake/lod/surface_walk.h"
#include "compress/bake/lod/triangle_images.h"
#include "compress/bake/lod/triangle_refiner.h"

namespace packtrace {
namespace {

constexpr double kSeen = 0.02;       // of a new triangle's area may be met by no old one
constexpr double kInflation = 1.001; // of what was measured, for all roundings
constexpr double kFine = 0.5;        // steps; distances below need no work
constexpr double kSlack = 1.1;       // how much larger than it must be the error of a group may be stated to save work

using Corners = std::array<DVec3, 3>;

/// A triangle before whose image is known, or that lies over those after: pieces_[first .. first + count).
struct Laid {
  uint32_t triangle;
  bool settled = false; ///< something better is known than what it says
  TriangleImages::Image image;
};

/// What a triangle makes the error at least, as far as laid_[index] knows.
struct Claim {
  double stated;
  uint32_t index;
  bool operator<(const Claim& o) const { return stated != o.stated ? stated < o.stated : index > o.index; }
};

class Measurer {
public:
  Measurer(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh)
      : m_(mesh), before_({points, triangles}, mesh.stands_for), after_({mesh.points, mesh.triangles}),
        walk_(before_.surface(), after_, mesh), images_(walk_, mesh), errors_(mesh.triangles.size()),
        bounds_(triangles.size()), seen_(mesh.triangles.size()), covered_(mesh.triangles.size()),
        mapped_(triangles.size()), unchanged_(triangles.size()) {}

  SurfaceLinks run() {
    after_.link();
    find_unchanged();
    links_.reserve(4 * unchanged_.size());
    laid_.reserve(unchanged_.size());
    claims_.reserve(unchanged_.size());
    for (uint32_t t = 0; t < unchanged_.size(); ++t)
      if (unchanged_[t] == 0) lay_over_after(t);
    settle();
    for (const uint32_t t : not_covered_) {
      best_.clear();
      after_.gather(before_.corner_points(t));
      measure_harder(t, std::numeric_limits<double>::infinity());
    }
    for (uint32_t s = 0; s < errors_.size(); ++s)
      if ((covered_[s] & TriangleImages::kWhole) == 0 && seen_[s] < 1.0 - kSeen) lay_over_before(s);
    for (size_t s = 0; s < errors_.size(); ++s) m_.triangles[s].error = errors_[s];
    return {std::move(links_), std::move(bounds_)};
  }

private:
  double had(uint32_t before) const { return before_.surface().triangles[before].error; }
  static double stated(double distance, double had) { return distance * kInflation + had; }

  /// A part of the triangle after is within the distance of one before.
  void note_after(uint32_t after, uint32_t before, double distance) {
    errors_[after] = std::max(errors_[after], stated(distance, had(before)));
    largest_ = std::max(largest_, errors_[after]);
    link(before, after);
  }

  void link(uint32_t before, uint32_t after) {
    if (links_.empty() || links_.back() != SurfaceLink{before, after}) links_.push_back({before, after});
  }

  /// A part of each is within the distance of the other.
  void note(uint32_t after, uint32_t before, double distance) {
    note_after(after, before, distance);
    bounds_[before] = std::max(bounds_[before], stated(distance, had(before)));
  }

  /// A group is as far off as its worst part: what is hardly worse needs no closer look.
  bool enough(double distance, double had) const {
    return distance <= kFine || stated(distance, had) <= std::max(largest_, kSlack * proven_);
  }

  void find_unchanged() {
    for (uint32_t s = 0; s < errors_.size(); ++s) {
      const Triangle& now = m_.triangles[s].points;
      const uint32_t t = m_.source[s];
      if (now != before_.surface().triangles[t].points || m_.moved[now.x] + m_.moved[now.y] + m_.moved[now.z] != 0)
        continue;
      unchanged_[t] = mapped_[t] = 1;
      covered_[s] = TriangleImages::kFront;
      seen_[s] = 1.0;
      note(s, t, 0.0);
    }
  }

  void lay_over_after(uint32_t t) {
    Laid laid{t, false, {}};
    mapped_[t] = images_.find(t, laid.image);
    if (mapped_[t] == 0) {
      after_.gather(before_.corner_points(t));
      laid.image.first = static_cast<uint32_t>(pieces_.size());
      if (!after_.lay(before_.corners(t), before_.surface().area_normal(t), pieces_)) {
        not_covered_.push_back(t);
        return;
      }
      laid.image.count = static_cast<uint32_t>(pieces_.size()) - laid.image.first;
      laid.image.distance = largest_of(laid);
    }
    if (laid.image.distance > kFine)
      claims_.push_back({stated(laid.image.distance, had(t)), static_cast<uint32_t>(laid_.size())});
    laid_.push_back(laid);
  }

  std::span<const OverlayPiece> pieces_of(const Laid& laid) const {
    return std::span(pieces_).subspan(laid.image.first, laid.image.count);
  }

  double largest_of(const Laid& laid) const {
    double largest = 0.0;
    for (const OverlayPiece& piece : pieces_of(laid)) largest = std::max(largest, piece.distance);
    return largest;
  }

  /// The worst first: what they really are leaves most others as they are.
  void settle() {
    std::make_heap(claims_.begin(), claims_.end());
    while (!claims_.empty() && claims_.front().stated > std::max(largest_, kSlack * proven_)) {
      std::pop_heap(claims_.begin(), claims_.end());
      Laid& laid = laid_[claims_.back().index];
      claims_.pop_back();
      laid.settled = true;
      const uint32_t t = laid.triangle;
      if (look_closer_at_image(laid)) continue;
      mapped_[t] = 0;
      after_.gather(before_.corner_points(t));
      best_.clear();
      // Not all of it may lie over those after, though its image does.
      const bool once = after_.lay(before_.corners(t), before_.surface().area_normal(t), best_);
      const double distance = once ? look_closer(t) : std::numeric_limits<double>::infinity();
      if (enough(distance, had(t)))
        accept(t);
      else
        measure_harder(t, distance);
    }
    edge_had_.assign(walk_.ways().size(), -1.0);
    point_had_.assign(before_.surface().points.size(), -1.0);
    for (const Laid& laid : laid_)
      if (mapped_[laid.triangle] != 0)
        see_image(laid);
      else if (!laid.settled)
        accept(pieces_of(laid), laid.triangle);
    accept_ways();
    for (const double error : errors_) largest_ = std::max(largest_, error);
    images_.find_covered(mapped_, covered_);
    for (const Laid& laid : laid_)
      if (mapped_[laid.triangle] != 0) add_shares(laid);
  }

  /// Where borders cross, the area says what images cover.
  void add_shares(const Laid& laid) {
    const auto met = images_.met(laid.image);
    if (std::any_of(met.begin(), met.end(), [&](uint32_t s) { return (covered_[s] & TriangleImages::kWhole) == 0; }))
      images_.add_shares(laid.triangle, laid.image, covered_, seen_);
  }

  /// What images cover, each seen from the side that it faces, needs no measuring of its own. Distances inside are
  /// noted here; ways and corners are shared with neighbours.
  void see_image(const Laid& laid) {
    const uint32_t t = laid.triangle;
    const Triangle& p = before_.surface().triangles[t].points;
    const std::span<const DVec3> points = before_.surface().points;
    const DVec3 normal = glm::cross(points[p.y] - points[p.x], points[p.z] - points[p.x]);
    const double had = this->had(t), inside = laid.settled ? 0.0 : stated(laid.image.inside, had);
    for (const uint32_t s : images_.met(laid.image)) {
      covered_[s] |= glm::dot(normal, walk_.area_normal(s)) > 0.0 ? TriangleImages::kFront : TriangleImages::kBack;
      errors_[s] = std::max(errors_[s], inside);
      if (!laid.settled) link(t, s);
    }
    if (laid.settled) return;
    bounds_[t] = std::max(bounds_[t], stated(laid.image.distance, had));
    for (int i = 0; i < 3; ++i) {
      double& of_edge = edge_had_[m_.side_edges[3 * size_t{t} + static_cast<size_t>(i)]];
      of_edge = std::max(of_edge, had);
      point_had_[p[i]] = std::max(point_had_[p[i]], had);
    }
  }

  /// The distances at crossings and corners of images, for the triangles after on both sides.
  void accept_ways() {
    for (uint32_t e = 0; e < edge_had_.size(); ++e) {
      const SurfaceWalk::Way& way = walk_.ways()[e];
      if (edge_had_[e] < 0.0 || way.state != SurfaceWalk::Way::State::kAcross) continue;
      uint32_t from = way.start;
      for (uint32_t k = way.first; k < way.first + way.count; ++k) {
        const double error = stated(std::sqrt(walk_.crossing(k).distance2), edge_had_[e]);
        const uint32_t into = walk_.into(k);
        errors_[from] = std::max(errors_[from], error);
        errors_[into] = std::max(errors_[into], error);
        from = into;
      }
    }
    for (uint32_t p = 0; p < point_had_.size(); ++p) {
      if (point_had_[p] < 0.0) continue;
      const SurfaceWalk::Place& place = walk_.place(p);
      const double error = stated(std::sqrt(place.distance2), point_had_[p]);
      if (place.state == SurfaceWalk::Place::State::kTriangle)
        errors_[place.number] = std::max(errors_[place.number], error);
      else if (place.distance2 > 0.0)
        for (const uint32_t s : after_.around(place.number)) errors_[s] = std::max(errors_[s], error);
    }
  }

  /// Images may be far from what they are images of where the surface is steep; the nearest point is what counts.
  bool look_closer_at_image(const Laid& laid) {
    const uint32_t t = laid.triangle;
    if (mapped_[t] == 0) return false;
    best_.clear();
    images_.look_closer(t, laid.image, best_);
    double largest = 0.0;
    for (const OverlayPiece& piece : best_) largest = std::max(largest, piece.distance);
    if (!enough(largest, had(t))) return false;
    accept(t);
    return true;
  }

  /// Straight up may be far where the surface is steep; the nearest point is what counts. Returns the largest of best_.
  double look_closer(uint32_t t) {
    double largest = 0.0;
    for (OverlayPiece& piece : best_) {
      if (!enough(piece.distance, had(t))) piece.distance = after_.overlay().nearest_distance(piece);
      largest = std::max(largest, piece.distance);
    }
    return largest;
  }

  void accept(uint32_t t) { accept(best_, t); }

  void accept(std::span<const OverlayPiece> pieces, uint32_t t) {
    for (const OverlayPiece& piece : pieces) {
      note(piece.triangle, t, piece.distance);
      seen_[piece.triangle] += piece.share;
    }
  }

  /// What no overlay bounds well is cut.
  /// @param bound of best_
  void measure_harder(uint32_t t, double bound) {
    const Corners p = before_.corners(t);
    if (after_.candidates().empty()) after_.gather_near(p[0]); // a line that hung together with nothing
    refine_over_after(t, bound, false);
    if (!enough(bound, had(t))) {
      after_.gather_within(p, bound);
      refine_over_after(t, bound, true);
    }
    accept(t);
  }

  /// @param all whether the candidates are all that matter: then what the corners' distance proves holds for others too
  void refine_over_after(uint32_t t, double& bound, bool all) {
    refiner_.begin(after_);
    // It is not below this, as far as the candidates go.
    const double before = proven_, least = stated(refiner_.measure_corners(before_.corners(t)), had(t));
    proven_ = std::max(proven_, least);
    if (!enough(bound, had(t))) {
      refined_.clear();
      const double refined = refiner_.run([&](double distance, uint32_t) { return enough(distance, had(t)); },
                                          [&](uint32_t s, double distance) {
                                            refined_.push_back({s, distance, 0.0});
                                          });
      if (refined < bound) std::swap(best_, refined_), bound = refined;
    }
    proven_ = all ? std::max(before, std::min(least, stated(bound, had(t)))) : before;
  }

  /// A triangle after of which the ones before saw too little: it is measured itself.
  void lay_over_before(uint32_t s) {
    before_.link();
    before_.gather(after_.corner_points(s));
    if (fits_over_before(s)) return;
    const double near = refine_over_before(s);
    if (near > std::max(largest_, kSlack * proven_)) {
      std::swap(refined_, best_);
      before_.gather_within(after_.corners(s), near);
      if (refine_over_before(s) >= near) std::swap(refined_, best_);
    }
    for (const OverlayPiece& piece : refined_) note_after(s, piece.triangle, piece.distance);
  }

  /// Returns the largest error that refined_ would make; infinite where nothing is near.
  double refine_over_before(uint32_t s) {
    double largest = before_.candidates().empty() ? std::numeric_limits<double>::infinity() : 0.0;
    refined_.clear();
    refiner_.begin(before_);
    refiner_.measure_corners(after_.corners(s));
    refiner_.run([&](double distance, uint32_t t) { return enough(distance, had(t)); },
                 [&](uint32_t t, double distance) {
                   refined_.push_back({t, distance, 0.0});
                   largest = std::max(largest, stated(distance, had(t)));
                 });
    return largest;
  }

  /// Notes the distances where they are small enough.
  bool fits_over_before(uint32_t s) {
    best_.clear();
    if (!before_.lay(after_.corners(s), after_.surface().area_normal(s), best_)) return false;
    for (OverlayPiece& piece : best_)
      if (!enough(piece.distance, had(piece.triangle))) {
        piece.distance = before_.overlay().nearest_distance(piece);
        if (!enough(piece.distance, had(piece.triangle))) return false;
      }
    for (const OverlayPiece& piece : best_) note_after(s, piece.triangle, piece.distance);
    return true;
  }

  SimplifyMesh& m_;
  SurfaceSide before_, after_;
  SurfaceWalk walk_;
  TriangleImages images_;
  std::vector<double> errors_; ///< of triangles after
  std::vector<double> bounds_; ///< of triangles before
  std::vector<SurfaceLink> links_;
  std::vector<double> seen_;     ///< share of each triangle after that was met
  std::vector<uint8_t> covered_; ///< per triangle after: bits of TriangleImages
  std::vector<uint8_t> mapped_;  ///< per triangle before: what is said of it holds for its image
  std::vector<uint8_t> unchanged_;
  std::vector<OverlayPiece> pieces_;
  std::vector<Laid> laid_;
  std::vector<Claim> claims_;                ///< a heap
  std::vector<double> edge_had_, point_had_; ///< the largest that accepted images at it had, or negative
  std::vector<uint32_t> not_covered_;
  std::vector<OverlayPiece> best_, refined_; ///< of the triangle at hand
  TriangleRefiner refiner_;
  double largest_ = 0.0; ///< the group's error is at least this, as noted
  double proven_ = 0.0;  ///< some triangle's error cannot be below, as far as its candidates go
};

} // namespace

LinkLists SurfaceLinks::by_after(size_t count) const {
  LinkLists lists{std::vector<uint32_t>(count + 1), std::vector<uint32_t>(links.size())};
  for (const SurfaceLink& link : links) ++lists.ends[link.after + 1];
  std::partial_sum(lists.ends.begin(), lists.ends.end(), lists.ends.begin());
  std::vector<uint32_t> next(lists.ends.begin(), lists.ends.end() - 1);
  for (const SurfaceLink& link : links) lists.before[next[link.after]++] = link.before;
  return lists;
}

SurfaceLinks bound_errors(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh) {
  return Measurer(points, triangles, mesh).run();
}

} // namespace packtrace
