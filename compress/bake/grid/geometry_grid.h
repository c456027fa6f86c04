#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// Key of a position, from its coordinates rounded to floats: one point of the source may differ in the last bits of
/// its doubles.
uint64_t position_key(DVec3 p);

/// A position that also belongs to a geometry on a coarser nested grid.
struct SharedPosition {
  uint64_t key = 0;   ///< position_key()
  uint32_t shift = 0; ///< the coarser grid's step is 2^shift times this grid's; 1..63
  bool operator<(const SharedPosition& other) const { return key < other.key; }
};

/// The lattice of a geometry, and the positions that are rounded to a coarser one.
///
/// World-space geometry lies on nested lattices: their steps are the scene's step times 2^-k. A position that several
/// geometries share is rounded to their coarsest lattice in all of them. That lattice point also lies on the finer
/// lattices, so all these geometries decode it to the same position and no crack opens.
struct GeometryGrid {
  PositionGrid grid;
  std::vector<SharedPosition> shared; ///< sorted by key

  /// Rounds a position to this lattice, or to the coarser lattice of its entry in `shared`.
  LatticePoint round(DVec3 p) const;
  /// Step of the coarsest lattice that any position is rounded to.
  double coarsest_step() const { return grid.step() * exp2_exact(static_cast<int32_t>(max_shift())); }
  /// Largest shift in `shared`; 0 if it is empty.
  uint32_t max_shift() const;
  /// lowest() is at most, and highest() at least, any lattice coordinate along an axis of positions in [lo, hi].
  int64_t lowest(double lo) const;
  int64_t highest(double hi) const;
};

} // namespace packtrace
