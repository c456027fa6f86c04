#include "compress/bake/lod/surface_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "compress/bake/lod/surface_side.h"
#include "compress/bake/lod/surface_walk.h"
#include "compress/bake/lod/triangle_refiner.h"

namespace packtrace {
namespace {

constexpr double kSeen = 0.02;       // of a new triangle's area may be met by no old one
constexpr double kInflation = 1.001; // of what was measured, for all roundings
constexpr uint8_t kBack = 2;         // covered, but from behind
constexpr double kFine = 0.5;        // steps; distances below need no work
constexpr double kSlack = 1.1;       // how much larger than it must be the error of a group may be stated to save work

using Corners = std::array<DVec3, 3>;

/// A triangle before that lies over those after: pieces_[first .. first + count).
struct Laid {
  double stated; ///< what it makes the error at least
  uint32_t triangle, first, count;
  bool operator<(const Laid& o) const { return stated != o.stated ? stated < o.stated : triangle > o.triangle; }
};

class Measurer {
public:
  Measurer(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh)
      : m_(mesh), before_({points, triangles}, [&](uint32_t p) { return mesh.stands_for[p]; }),
        after_({mesh.points, mesh.triangles}, [](uint32_t p) { return p; }), walk_(before_.surface(), after_, mesh),
        errors_(mesh.triangles.size()), bounds_(triangles.size()), seen_(mesh.triangles.size()),
        covered_(mesh.triangles.size()), mapped_(triangles.size()), unchanged_(triangles.size()) {}

  SurfaceLinks run() {
    after_.link();
    find_unchanged();
    links_.reserve(4 * unchanged_.size());
    pieces_.reserve(7 * unchanged_.size());
    laid_.reserve(unchanged_.size());
    for (uint32_t t = 0; t < unchanged_.size(); ++t)
      if (unchanged_[t] == 0) lay_over_after(t);
    settle();
    for (const uint32_t t : not_covered_) {
      best_.clear();
      after_.gather(before_.corner_points(t));
      measure_harder(t, std::numeric_limits<double>::infinity());
    }
    for (uint32_t s = 0; s < errors_.size(); ++s)
      if (covered_[s] != 1 && seen_[s] < 1.0 - kSeen) lay_over_before(s);
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
      seen_[s] = 1.0;
      note(s, t, 0.0);
    }
  }

  void lay_over_after(uint32_t t) {
    const auto first = static_cast<uint32_t>(pieces_.size());
    mapped_[t] = walk_.lay(t, SurfaceWalk::Look::kAtImages, pieces_);
    if (mapped_[t] == 0) {
      after_.gather(before_.corner_points(t));
      if (!after_.lay(before_.corners(t), before_.surface().area_normal(t), pieces_)) {
        not_covered_.push_back(t);
        return;
      }
    }
    double largest = 0.0;
    for (size_t i = first; i < pieces_.size(); ++i) largest = std::max(largest, pieces_[i].distance);
    laid_.push_back(
        {largest <= kFine ? 0.0 : stated(largest, had(t)), t, first, static_cast<uint32_t>(pieces_.size() - first)});
  }

  /// The worst first: what they really are leaves most others as they are.
  void settle() {
    std::make_heap(laid_.begin(), laid_.end());
    while (!laid_.empty() && laid_.front().stated > std::max(largest_, kSlack * proven_)) {
      std::pop_heap(laid_.begin(), laid_.end());
      const uint32_t t = laid_.back().triangle;
      laid_.pop_back();
      if (look_closer_at_image(t)) continue;
      mapped_[t] = 0;
      after_.gather(before_.corner_points(t));
      best_.clear();
      after_.lay(before_.corners(t), before_.surface().area_normal(t), best_);
      const double distance = look_closer(after_, t);
      if (enough(distance, had(t)))
        accept(t);
      else
        measure_harder(t, distance);
    }
    for (const Laid& laid : laid_) accept(laid);
    for (const Laid& laid : looked_) accept(laid);
    walk_.find_borders(mapped_, covered_);
    for (const Laid& laid : laid_) add_shares(laid);
    for (const Laid& laid : looked_) add_shares(laid);
  }

  /// What images cover, each seen from the side that it faces, needs no measuring of its own.
  void accept(const Laid& laid) {
    const bool mapped = mapped_[laid.triangle] != 0;
    const DVec3 normal = mapped ? before_.surface().area_normal(laid.triangle) : DVec3(0.0);
    for (const OverlayPiece& piece : std::span(pieces_).subspan(laid.first, laid.count)) {
      note(piece.triangle, laid.triangle, piece.distance);
      seen_[piece.triangle] += piece.share;
      if (!mapped) continue;
      uint8_t& covered = covered_[piece.triangle];
      if (!(glm::dot(normal, walk_.area_normal(piece.triangle)) > 0.0))
        covered = kBack;
      else if (covered == 0)
        covered = 1;
    }
  }

  /// Where borders cross, the area says what images cover.
  void add_shares(const Laid& laid) {
    if (mapped_[laid.triangle] == 0) return;
    const auto pieces = std::span(pieces_).subspan(laid.first, laid.count);
    if (std::all_of(pieces.begin(), pieces.end(), [&](const OverlayPiece& p) { return covered_[p.triangle] == 1; }))
      return;
    best_.clear();
    walk_.lay(laid.triangle, SurfaceWalk::Look::kShares, best_);
    for (const OverlayPiece& piece : best_) seen_[piece.triangle] += piece.share;
  }

  /// Images may be far from what they are images of where the surface is steep; the nearest point is what counts.
  bool look_closer_at_image(uint32_t t) {
    if (mapped_[t] == 0) return false;
    const auto first = static_cast<uint32_t>(pieces_.size());
    walk_.lay(t, SurfaceWalk::Look::kCloser, pieces_);
    double largest = 0.0;
    for (size_t i = first; i < pieces_.size(); ++i) largest = std::max(largest, pieces_[i].distance);
    if (!enough(largest, had(t))) {
      pieces_.resize(first);
      return false;
    }
    largest_ = std::max(largest_, stated(largest, had(t)));
    looked_.push_back({stated(largest, had(t)), t, first, static_cast<uint32_t>(pieces_.size() - first)});
    return true;
  }

  /// Straight up may be far where the surface is steep; the nearest point is what counts. Returns the largest of best_.
  double look_closer(SurfaceSide& side, uint32_t t) {
    double largest = 0.0;
    for (OverlayPiece& piece : best_) {
      if (!enough(piece.distance, had(t))) piece.distance = side.overlay().nearest_distance(piece);
      largest = std::max(largest, piece.distance);
    }
    return largest;
  }

  void accept(uint32_t t) {
    for (const OverlayPiece& piece : best_) {
      note(piece.triangle, t, piece.distance);
      seen_[piece.triangle] += piece.share;
    }
  }

  /// Seen from where the new surface faces, slivers and small dents lie flatter; and it may reach further. What no
  /// overlay bounds well is cut.
  /// @param bound of best_
  void measure_harder(uint32_t t, double bound) {
    const Corners p = before_.corners(t);
    if (after_.candidates().empty()) after_.gather_near(p[0]); // a line that hung together with nothing
    look_along_facing(t, bound);
    if (enough(bound, had(t))) return accept(t);
    after_.widen();
    look_along_facing(t, bound);
    if (enough(bound, had(t))) return accept(t);
    refine_over_after(t, bound, false);
    if (!enough(bound, had(t))) {
      after_.gather_within(p, bound);
      refine_over_after(t, bound, true);
    }
    accept(t);
  }

  /// @param all whether the candidates are all that matter: then what the corners' distance proves holds for others too
  void refine_over_after(uint32_t t, double& bound, bool all) {
    const Corners p = before_.corners(t);
    // It is not below this, as far as the candidates go.
    const double before = proven_, least = stated(farthest_corner(p), had(t));
    proven_ = std::max(proven_, least);
    if (!enough(bound, had(t))) {
      refined_.clear();
      const double refined = refiner_.run(
          p, after_, [&](double distance, uint32_t) { return enough(distance, had(t)); },
          [&](uint32_t s, double distance) {
            refined_.push_back({s, distance, 0.0});
          });
      if (refined < bound) std::swap(best_, refined_), bound = refined;
    }
    proven_ = all ? std::max(before, std::min(least, stated(bound, had(t)))) : before;
  }

  /// Keeps the better of best_ and what is seen from where the candidates face.
  void look_along_facing(uint32_t t, double& bound) {
    DVec3 facing(0.0);
    for (const uint32_t s : after_.candidates()) facing += after_.surface().area_normal(s);
    std::swap(best_, second_);
    best_.clear();
    if (after_.lay(before_.corners(t), facing, best_))
      if (const double distance = look_closer(after_, t); distance < bound) {
        bound = distance;
        return;
      }
    std::swap(best_, second_);
  }

  /// The distance of the corner that is farthest from all candidates.
  double farthest_corner(const Corners& triangle) {
    set_.clear();
    for (const uint32_t s : after_.candidates()) set_.add(after_.surface(), s);
    double farthest = 0.0;
    for (const DVec3& corner : triangle) {
      set_.distances(corner, distances_);
      if (!set_.empty())
        farthest = std::max(farthest, *std::min_element(distances_.begin(),
                                                        distances_.begin() + static_cast<std::ptrdiff_t>(set_.size())));
    }
    return farthest;
  }

  /// A triangle after of which the ones before saw too little: it is measured itself.
  void lay_over_before(uint32_t s) {
    before_.link();
    before_.gather(after_.corner_points(s));
    if (fits_over_before(s)) return;
    before_.widen();
    if (fits_over_before(s)) return;
    const double near = refine_over_before(s);
    if (near > std::max(largest_, kSlack * proven_)) {
      std::swap(refined_, second_);
      before_.gather_within(after_.corners(s), near);
      if (refine_over_before(s) >= near) std::swap(refined_, second_);
    }
    for (const OverlayPiece& piece : refined_) note_after(s, piece.triangle, piece.distance);
  }

  /// Returns the largest error that refined_ would make.
  double refine_over_before(uint32_t s) {
    double largest = 0.0;
    refined_.clear();
    refiner_.run(
        after_.corners(s), before_, [&](double distance, uint32_t t) { return enough(distance, had(t)); },
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
  std::vector<double> errors_; ///< of triangles after
  std::vector<double> bounds_; ///< of triangles before
  std::vector<SurfaceLink> links_;
  std::vector<double> seen_;     ///< share of each triangle after that was met
  std::vector<uint8_t> covered_; ///< per triangle after: images of those before cover it
  std::vector<uint8_t> mapped_;  ///< per triangle before: what is said of it holds for its image
  std::vector<uint8_t> unchanged_;
  std::vector<OverlayPiece> pieces_;
  std::vector<Laid> laid_, looked_;
  std::vector<uint32_t> not_covered_;
  std::vector<OverlayPiece> best_, second_, refined_; ///< of the triangle at hand
  TriangleRefiner refiner_;
  TriangleSet set_;
  std::vector<double> distances_;
  double largest_ = 0.0; ///< the group's error is at least this, as noted
  double proven_ = 0.0;  ///< some triangle's error cannot be below, as far as its candidates go
};

} // namespace

SurfaceLinks bound_errors(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh) {
  return Measurer(points, triangles, mesh).run();
}

} // namespace packtrace
