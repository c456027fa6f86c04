#include "compress/format/trees/tree_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace packtrace {
namespace {

/// Range of lattice coordinates along one axis, in units of the coarsest step.
struct Range {
  double lo = std::numeric_limits<double>::infinity(), hi = -std::numeric_limits<double>::infinity();

  bool movable() const { return (lo > 0.0 && hi <= 2.0 * lo) || (hi < 0.0 && lo >= 2.0 * hi); }
  double largest() const { return std::max(std::abs(lo), std::abs(hi)); }
  double centre() const { return lo + 0.5 * (hi - lo); }
  /// Largest |coordinate| once the origin is subtracted.
  double reach() const { return movable() ? 0.5 * (hi - lo) : largest(); }
};

using Box = std::array<Range, 3>;

void extend(Box& box, const baked::GeometryRecord& geometry, std::span<const baked::ClusterRecord> clusters,
            double scale) {
  for (const baked::ClusterRecord& cluster : clusters) {
    const LatticeBox part = box_of_record(geometry, cluster);
    for (size_t axis = 0; axis < 3; ++axis) {
      box[axis].lo = std::min(box[axis].lo, static_cast<double>(part.lo[axis]) * scale);
      box[axis].hi = std::max(box[axis].hi, static_cast<double>(part.hi[axis]) * scale);
    }
  }
}

} // namespace

void choose_tree_grid(std::span<const baked::GeometryRecord* const> geometries,
                      std::span<const baked::ClusterRecord> clusters, baked::TreeRecord& tree) {
  int32_t coarsest = std::numeric_limits<int32_t>::min(), finest = std::numeric_limits<int32_t>::max();
  for (const baked::GeometryRecord* g : geometries)
    coarsest = std::max(coarsest, g->step_exponent), finest = std::min(finest, g->step_exponent);
  Box box;
  for (const baked::GeometryRecord* g : geometries)
    extend(box, *g, clusters.subspan(static_cast<size_t>(g->first_cluster), g->cluster_count),
           exp2_exact(g->step_exponent - coarsest));

  // Doubles hold 53 of up to 60 bits of a coordinate, hence the margins.
  constexpr double kReach = baked::kMaxTreeCoordinate - 1024.0, kLargest = 0x1p60;
  const auto fits = [&](double scale) {
    return std::all_of(box.begin(), box.end(), [&](const Range& range) {
      return range.reach() * scale <= kReach && range.largest() * scale <= kLargest;
    });
  };
  int32_t exponent = finest;
  while (!fits(exp2_exact(coarsest - exponent))) ++exponent;
  tree.step_mantissa = geometries.front()->step_mantissa;
  tree.step_exponent = exponent;
  for (size_t axis = 0; axis < 3; ++axis)
    tree.origin[axis] = box[axis].movable() ? std::llrint(box[axis].centre() * exp2_exact(coarsest - exponent)) : 0;
}

} // namespace packtrace
