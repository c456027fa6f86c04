#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Which triangles of the level below each triangle of a coarser level stands for: all those of which part may be found
/// there.
/// Only the last few levels are kept.
class TriangleHistory {
public:
  /// How many levels back errors are measured.
  static constexpr uint32_t kDepth = 3;

  /// @param first_triangle number of the first triangle of level 1
  explicit TriangleHistory(uint32_t first_triangle = 0) : next_triangle_(first_triangle) {}

  void begin_level();
  /// Triangles of the level begun, in order.
  /// @param ends per triangle: of `below`
  /// @param below numbers of triangles of the level below
  void append(std::span<const uint32_t> ends, std::span<const uint32_t> below);

  /// Empty for level 0 and for levels that are not kept.
  std::span<const uint32_t> below(uint32_t triangle) const;

private:
  struct Level {
    uint32_t first_triangle;
    std::vector<uint32_t> ends, below;
  };
  std::vector<Level> levels_; ///< the last kDepth
  uint32_t next_triangle_;
};

/// The triangles of all levels so far.
struct LevelTriangles {
  std::span<const LatticePoint> positions;
  std::span<const QuantizedVertex> vertices;
  std::span<const Triangle> triangles;
  std::span<const double> errors; ///< per triangle: of its surface, lattice steps
  const TriangleHistory& history;
};

} // namespace packtrace
