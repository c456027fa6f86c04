#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// Identifies a position by its coordinates as floats: what the source has as one point may differ in the last bits of
/// doubles.
uint64_t position_key(DVec3 p);

/// A position that geometry on a coarser nested grid has too.
struct SharedPosition {
  uint64_t key = 0;   ///< position_key()
  uint32_t shift = 0; ///< the coarser grid's step is 2^shift times this one's; 1..63
  bool operator<(const SharedPosition& other) const { return key < other.key; }
};

/// The lattice of a geometry, and the positions that are rounded more coarsely on it.
///
/// World-space geometry lies on nested lattices, whose steps are the scene's times 2^-k. A position that several
/// geometries share is rounded to the coarsest of their lattices in all of them: that is a point of the finer ones as
/// well, so the geometries decode to the same point there and stay closed.
struct GeometryGrid {
  PositionGrid grid;
  std::vector<SharedPosition> shared; ///< sorted

  LatticePoint round(DVec3 p) const;
  /// Of the coarsest lattice that some position is rounded to.
  double coarsest_step() const { return grid.step() * exp2_exact(static_cast<int32_t>(max_shift())); }
  uint32_t max_shift() const;
  /// At most the smallest, or at least the largest, lattice coordinate of positions in [lo, hi] along an axis.
  int64_t lowest(double lo) const;
  int64_t highest(double hi) const;
};

} // namespace packtrace
