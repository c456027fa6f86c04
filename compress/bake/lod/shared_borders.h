#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"

namespace packtrace {

/// Positions that several geometries share and that lie on a border of at least one of them. LOD levels must not move
/// them: geometries are simplified independently, so the seam between them would open.
///
/// Positions are compared as exact products lattice x step, so geometries on grids with different steps share the
/// positions that lie on both lattices.
class SharedBorders {
public:
  SharedBorders() = default;

  bool empty() const { return keys_.empty(); }
  /// Per position of the geometry: 1 if it must not move. Empty if all may move.
  std::vector<uint8_t> locks(const QuantizedGeometry& geometry) const;

private:
  friend class SharedBorderFinder;
  std::vector<uint64_t> keys_; ///< sorted position hashes; a collision only locks a position unnecessarily
};

/// Collects positions, geometry by geometry. Needs 8 bytes per position and n log n time in total.
class SharedBorderFinder {
public:
  /// @param geometry_count upper limit of the numbers passed to add()
  explicit SharedBorderFinder(size_t geometry_count) : keys_(geometry_count) {}

  /// Adds a geometry, once per number; its positions must be distinct. May be called concurrently for different
  /// geometries.
  void add(size_t number, const QuantizedGeometry& geometry);
  /// Returns what the added geometries share, and empties the finder.
  SharedBorders finish();

private:
  std::vector<std::vector<uint64_t>> keys_; ///< per geometry: position hash x 2, + 1 on a border
};

/// Per position: 1 on a border. An edge is interior if exactly two triangles have it, in opposite directions and not
/// folded back onto each other; all others are borders. Degenerate triangles have no edges.
std::vector<uint8_t> border_positions(const QuantizedGeometry& geometry);

} // namespace packtrace
