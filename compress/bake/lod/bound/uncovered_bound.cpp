#include "compress/bake/lod/bound/uncovered_bound.h"

#include <algorithm>
#include <limits>

namespace packtrace {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr uint32_t kMaxSubdivisions = 3; // subdivision levels here; the refiner adds its own
// Maximum number of distances per triangle (source and simplified). Limits the time in soups, where every triangle is
// near all others and more work gains little.
constexpr size_t kWork = 100;

} // namespace

bool UncoveredBound::spent() const {
  return refiner_.work() > kWork * (source_.surface().triangles.size() + simplified_.surface().triangles.size());
}

void UncoveredBound::measure(uint32_t triangle, std::span<const uint32_t> found) {
  // The overlay is often complete after the triangles in `found`.
  source_.gather(simplified_.corner_points(triangle), found);
  const size_t first = parts_.size();
  double least = 0.0;
  const double stated = measure_part(triangle, simplified_.corners(triangle), least);
  claims_.push_back({stated, triangle, first, parts_.size() - first});
}

std::vector<PartDistance> UncoveredBound::finish() {
  std::sort(claims_.rbegin(), claims_.rend());
  std::vector<PartDistance> result;
  for (const Claim& claim : claims_) {
    size_t first = claim.first, count = claim.count;
    double stated = claim.stated;
    if (stated > error_.limit()) {
      const Corners corners = simplified_.corners(claim.triangle);
      source_.gather_within(corners, stated);
      const size_t begin = parts_.size();
      const double closer = look_closer(claim.triangle, corners, stated, 0);
      if (closer < stated) stated = closer, first = begin, count = parts_.size() - begin;
    }
    error_.largest = std::max(error_.largest, stated);
    const auto from = parts_.begin() + static_cast<std::ptrdiff_t>(first);
    result.insert(result.end(), from, from + static_cast<std::ptrdiff_t>(count));
  }
  return result;
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
  double by_overlay = kInfinite;
  if (overlay(part, by_overlay) && (by_overlay <= error_.limit() || overlay_near(by_overlay))) {
    for (const OverlayPiece& piece : mapped_triangles_) parts_.push_back({triangle, piece.triangle, piece.distance});
    return by_overlay;
  }
  refiner_.begin(source_);
  least = refiner_.measure_corners(part);
  const double by_cutting = refine();
  for (const OverlayPiece& piece : by_overlay < by_cutting ? mapped_triangles_ : refined_)
    parts_.push_back({triangle, piece.triangle, piece.distance});
  return std::min(by_overlay, by_cutting);
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
  double stated = source_.candidates().empty() ? kInfinite : 0.0;
  refiner_.run([&](double distance, uint32_t t) { return error_.enough(distance, inherited_error(t)); },
               [&](uint32_t t, double distance) {
                 refined_.push_back({t, 0, distance});
                 stated = std::max(stated, stated_error(distance, inherited_error(t)));
               });
  return stated;
}

} // namespace packtrace
