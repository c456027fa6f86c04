#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Lists, for each triangle of a coarser level, the triangles one level below that it may represent. Keeps the last
/// kDepth levels only.
class TriangleHistory {
public:
  /// Number of levels over which errors are measured directly.
  static constexpr uint32_t kDepth = 3;

  /// @param first_triangle number of the first triangle of level 1
  explicit TriangleHistory(uint32_t first_triangle = 0) : next_triangle_(first_triangle) {}

  void begin_level();
  /// Appends triangles to the current level, in order.
  /// @param ends per triangle: end of its range in `below`
  /// @param below triangle numbers of the level below
  void append(std::span<const uint32_t> ends, std::span<const uint32_t> below);

  /// Empty for level 0 and for levels that are no longer kept.
  std::span<const uint32_t> below(uint32_t triangle) const;

private:
  struct Level {
    uint32_t first_triangle;
    std::vector<uint32_t> ends, below;
  };
  std::vector<Level> levels_; ///< the last kDepth
  uint32_t next_triangle_;
};

/// The triangles of all levels built so far.
struct LevelTriangles {
  std::span<const LatticePoint> positions;
  std::span<const QuantizedVertex> vertices;
  std::span<const Triangle> triangles;
  std::span<const double> errors; ///< per triangle: error of its surface, lattice steps
  const TriangleHistory& history;
};

} // namespace packtrace
