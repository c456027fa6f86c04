#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compress/format/baked_format.h"
#include "compress/format/packed_node.h"
#include "compress/format/position_grid.h"

namespace packtrace {

/// Steps of a geometry's lattice in a tree's: 2^k, k = -1000 .. 62.
class TreeGridMap {
public:
  TreeGridMap(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry)
      : origin_(tree.origin), shift_(geometry.step_exponent - tree.step_exponent) {}

  /// The tree coordinate of a lattice coordinate, rounded down and up.
  int64_t floor(int64_t q, size_t axis) const { return scaled(q) - origin_[axis]; }
  int64_t ceil(int64_t q, size_t axis) const { return -scaled(-q) - origin_[axis]; }

private:
  int64_t scaled(int64_t q) const {
    if (shift_ >= 0) return static_cast<int64_t>(static_cast<uint64_t>(q) << (shift_ < 62 ? shift_ : 62));
    return q >> (shift_ > -63 ? -shift_ : 63);
  }
  std::array<int64_t, 3> origin_;
  int32_t shift_;
};

/// The finest grid of a tree over some geometries that have one step_mantissa and steps that differ by 2^60 at most:
/// fills in step and origin (TreeRecord says how it is chosen).
/// @param clusters the cluster section
void choose_tree_grid(std::span<const baked::GeometryRecord* const> geometries,
                      std::span<const baked::ClusterRecord> clusters, baked::TreeRecord& tree);

} // namespace packtrace
