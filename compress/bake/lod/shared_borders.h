#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"

namespace packtrace {

/// Positions that several geometries have in common and that lie on a border of at least one of them. Levels of detail
/// must not move them: each geometry is simplified on its own, and the seam between two would open.
///
/// Positions are compared as the exact products lattice x step, so geometries on grids of different steps share the
/// positions that lie on both lattices.
class SharedBorders {
public:
  SharedBorders() = default;

  bool empty() const { return keys_.empty(); }
  /// Per position of the geometry: 1 where it must stay. Empty where all may move.
  std::vector<uint8_t> locks(const QuantizedGeometry& geometry) const;

private:
  friend class SharedBorderFinder;
  std::vector<uint64_t> keys_; ///< hashes of positions, ascending; a collision locks a position without need
};

/// Collects the positions of one geometry after the other. Takes 8 bytes a position, and n log n time in all.
class SharedBorderFinder {
public:
  /// @param geometry_count add() takes numbers below it
  explicit SharedBorderFinder(size_t geometry_count) : keys_(geometry_count) {}

  /// May be called on several threads for different geometries; once for each. Its positions are distinct.
  void add(size_t number, const QuantizedGeometry& geometry);
  /// What is shared by the geometries added. Leaves the finder empty.
  SharedBorders finish();

private:
  std::vector<std::vector<uint64_t>> keys_; ///< by geometry: hash of a position x 2, + 1 on a border
};

/// Per position: 1 on a border. An edge is inside where just two triangles have it, in opposite directions, and do not
/// fold back onto each other; every other edge is a border. Triangles with two corners in one place have no edges.
std::vector<uint8_t> border_positions(const QuantizedGeometry& geometry);

} // namespace packtrace
