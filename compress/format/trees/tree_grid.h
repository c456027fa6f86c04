#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compress/format/cluster/lattice_box.h"
#include "compress/format/cluster/position_grid.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/layout/packed_node.h"

namespace packtrace {

/// Maximum |difference| of the step exponents of a tree and its geometries.
inline constexpr int32_t kMaxTreeStepDoublings = 60;

/// Box that contains a cluster's vertices, from its record alone. It is up to about twice as large per axis.
inline LatticeBox box_of_record(const baked::GeometryRecord& geometry, const baked::ClusterRecord& cluster) {
  LatticeBox box;
  for (size_t axis = 0; axis < 3; ++axis) {
    box.lo[axis] = geometry.origin[axis] + int64_t{cluster.anchor[axis]} * (int64_t{1} << geometry.anchor_shift);
    box.hi[axis] = box.lo[axis] + ((int64_t{1} << cluster.position_bits[axis]) - 1);
  }
  return box;
}

/// Maps a geometry's lattice to a tree's grid. Scaled coordinates are clamped to +-2^61 before the origin is
/// subtracted.
class TreeGridMap {
public:
  /// The step exponents differ by at most kMaxTreeStepDoublings; |lattice coordinate| <= 2^59, |origin| <= 2^60.
  TreeGridMap(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry)
      : TreeGridMap(tree, geometry.step_exponent) {}
  /// For any lattice with the tree's step mantissa.
  TreeGridMap(const baked::TreeRecord& tree, int32_t step_exponent)
      : origin_(tree.origin), shift_(step_exponent - tree.step_exponent),
        limit_((int64_t{1} << 61) >> (shift_ > 0 ? shift_ : 0)) {}

  /// Tree coordinate of a lattice coordinate, rounded down or up.
  int64_t floor(int64_t q, size_t axis) const { return scaled(q) - origin_[axis]; }
  int64_t ceil(int64_t q, size_t axis) const { return -scaled(-q) - origin_[axis]; }

private:
  int64_t scaled(int64_t q) const {
    if (shift_ < 0) return q >> -shift_;
    return (q < -limit_ ? -limit_ : q > limit_ ? limit_ : q) * (int64_t{1} << shift_);
  }
  std::array<int64_t, 3> origin_;
  int32_t shift_;
  int64_t limit_;
};

/// Chooses the finest possible grid for a tree over geometries with equal step_mantissa and step exponents that differ
/// by at most 60. Sets step and origin as TreeRecord specifies.
/// @param clusters the cluster section
void choose_tree_grid(std::span<const baked::GeometryRecord* const> geometries,
                      std::span<const baked::ClusterRecord> clusters, baked::TreeRecord& tree);

} // namespace packtrace
