#include "compress/bake/lod/bound/uncovered_bound.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace packtrace {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr uint32_t kMaxSubdivisions = 3; // subdivision levels here; the refiner adds its own
// Maximum number of distances per triangle (source and simplified). Limits the time in soups, where every triangle is
// near all others and more work gains little.
constexpr size_t kWorkPerTriangle = 400;

} // namespace

bool UncoveredBound::spent() const {
  return refiner_.work() >
         kWorkPerTriangle * (source_.surface().triangles.size() + simplified_.surface().triangles.size());
}

void UncoveredBound::measure(uint32_t triangle, std::span<const uint32_t> found) {
  // The overlay is often complete after the triangles in `found`.
  source_.gather(simplified_.corner_points(triangle), found);
  Claim claim{0.0, triangle, parts_.size(), 0, {}};
  const Corners corners = simplified_.corners(triangle);
  if (overlay(corners, claim.stated)) {
    if (claim.stated > error_.limit() && !overlay_near(claim.stated)) claim.not_cut = found;
    note_parts(triangle, mapped_triangles_);
  } else {
    claim.stated = cut(corners).stated;
    note_parts(triangle, refined_);
  }
  claim.count = parts_.size() - claim.first;
  claims_.push_back(claim);
}

std::vector<PartDistance> UncoveredBound::finish() {
  std::make_heap(claims_.begin(), claims_.end());
  std::vector<PartDistance> result;
  while (!claims_.empty()) {
    std::pop_heap(claims_.begin(), claims_.end());
    Claim& claim = claims_.back();
    if (claim.stated > error_.limit() && !claim.not_cut.empty()) {
      cut_later(claim);
      std::push_heap(claims_.begin(), claims_.end());
      continue;
    }
    if (claim.stated > error_.limit()) {
      const Corners corners = simplified_.corners(claim.triangle);
      source_.gather_within(corners, claim.stated);
      const size_t begin = parts_.size();
      const double closer = look_closer(claim.triangle, corners, claim.stated, 0);
      if (closer < claim.stated) claim.stated = closer, claim.first = begin, claim.count = parts_.size() - begin;
    }
    error_.largest = std::max(error_.largest, claim.stated);
    const auto from = parts_.begin() + static_cast<std::ptrdiff_t>(claim.first);
    result.insert(result.end(), from, from + static_cast<std::ptrdiff_t>(claim.count));
    claims_.pop_back();
  }
  return result;
}

/// Subdivides a triangle that has only been overlaid, and keeps the smaller bound.
void UncoveredBound::cut_later(Claim& claim) {
  source_.gather(simplified_.corner_points(claim.triangle), std::exchange(claim.not_cut, {}));
  const double stated = cut(simplified_.corners(claim.triangle)).stated;
  if (stated >= claim.stated) return;
  claim.stated = stated, claim.first = parts_.size(), claim.count = refined_.size();
  note_parts(claim.triangle, refined_);
}

/// Bounds a part's largest distance from the candidates by subdivision. Writes the pieces to refined_.
UncoveredBound::CutBounds UncoveredBound::cut(const Corners& part) {
  refiner_.begin(source_);
  const double least = refiner_.measure_corners(part);
  return {least, refine()};
}

void UncoveredBound::note_parts(uint32_t triangle, std::span<const OverlayPiece> pieces) {
  for (const OverlayPiece& piece : pieces) parts_.push_back({triangle, piece.triangle, piece.distance});
}

/// Subdivides the part into four while that can lower its bound. Appends the bounds to parts_ and returns the part's
/// error bound.
/// @param known an upper bound that is already known
double UncoveredBound::look_closer(uint32_t triangle, const Corners& part, double known, uint32_t depth) {
  const size_t begin = parts_.size();
  double least = 0.0;
  const double stated = measure_part(triangle, part, least);
  error_.proven = std::max(error_.proven, least);
  double largest = 0.0; // largest distance in parts_
  for (size_t i = begin; i < parts_.size(); ++i) largest = std::max(largest, parts_[i].distance);
  if (depth == kMaxSubdivisions || stated <= error_.limit() || largest <= GroupError::kSlack * least || spent())
    return stated;
  const size_t end = parts_.size();
  const Corners middles{0.5 * (part[0] + part[1]), 0.5 * (part[1] + part[2]), 0.5 * (part[2] + part[0])};
  double closer = 0.0;
  for (const Corners& quarter : {Corners{part[0], middles[0], middles[2]}, Corners{middles[0], part[1], middles[1]},
                                 Corners{middles[2], middles[1], part[2]}, Corners{middles[0], middles[1], middles[2]}})
    if (closer < std::min(stated, known))
      closer = std::max(closer, look_closer(triangle, quarter, std::min(stated, known), depth + 1));
  const auto at = [&](size_t i) { return parts_.begin() + static_cast<std::ptrdiff_t>(i); };
  if (closer >= stated) {
    parts_.erase(at(end), parts_.end());
    return stated;
  }
  parts_.erase(at(begin), at(end));
  return closer;
}

/// Measures a part against the current candidates. Appends the bounds to parts_ and returns the part's error bound.
/// @param least set to a lower bound of the part's largest distance from the candidates; unchanged if the overlay is
/// enough
double UncoveredBound::measure_part(uint32_t triangle, const Corners& part, double& least) {
  double by_overlay = kUnbounded;
  if (overlay(part, by_overlay) && (by_overlay <= error_.limit() || overlay_near(by_overlay))) {
    note_parts(triangle, mapped_triangles_);
    return by_overlay;
  }
  const CutBounds by_cutting = cut(part);
  least = by_cutting.least;
  note_parts(triangle, by_overlay < by_cutting.stated ? mapped_triangles_ : refined_);
  return std::min(by_overlay, by_cutting.stated);
}

/// Overlays the part on the candidates and writes the pieces to mapped_triangles_. Returns false if none covers it.
bool UncoveredBound::overlay(const Corners& part, double& stated) {
  mapped_triangles_.clear();
  const DVec3 normal = glm::cross(part[1] - part[0], part[2] - part[0]);
  if (!source_.overlay(part, normal, mapped_triangles_) && !source_.overlay().overlay_over_borders(mapped_triangles_))
    return false;
  stated = 0.0;
  for (OverlayPiece& piece : mapped_triangles_) {
    const double inherited_error = this->inherited_error(piece.triangle);
    if (!error_.enough(piece.distance, inherited_error)) piece.distance = source_.overlay().nearest_distance(piece);
    stated = std::max(stated, stated_error(piece.distance, inherited_error));
  }
  return true;
}

/// Replaces mapped_triangles_ by pieces that are all near enough. Returns false, and changes nothing, if these do not
/// bound the part.
bool UncoveredBound::overlay_near(double& stated) {
  refined_.clear();
  if (!source_.overlay().overlay_near(
          [&](uint32_t t, double distance) { return error_.enough(distance, inherited_error(t)); }, refined_))
    return false;
  std::swap(mapped_triangles_, refined_);
  stated = 0.0;
  for (const OverlayPiece& piece : mapped_triangles_)
    stated = std::max(stated, stated_error(piece.distance, inherited_error(piece.triangle)));
  return true;
}

/// Bounds the part that measure_corners() was called for by subdivision.
double UncoveredBound::refine() {
  refined_.clear();
  double stated = source_.candidates().empty() ? kUnbounded : 0.0;
  refiner_.run([&](double distance, uint32_t t) { return error_.enough(distance, inherited_error(t)); },
               [&](uint32_t t, double distance) {
                 refined_.push_back({t, 0, distance});
                 stated = std::max(stated, stated_error(distance, inherited_error(t)));
               });
  return stated;
}

} // namespace packtrace
