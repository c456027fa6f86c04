#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/distance_kernel.h"
#include "compress/bake/lod/bound/triangle_overlay.h"

namespace packtrace {

/// Numbered triangles that points are measured against, four per SIMD operation.
class TriangleSet {
public:
  void clear() { numbers_.clear(), blocks_.clear(); }
  void add(const OverlaySurface& surface, uint32_t triangle) {
    add({surface.corner(triangle, 0), surface.corner(triangle, 1), surface.corner(triangle, 2)}, triangle);
  }
  void add(const std::array<DVec3, 3>& corners, uint32_t number);
  /// Adds triangle i of another set, with its number.
  void add(const TriangleSet& other, size_t i);

  size_t size() const { return numbers_.size(); }
  bool empty() const { return numbers_.empty(); }
  uint32_t number(size_t i) const { return numbers_[i]; }

  std::array<DVec3, 3> corners(size_t i) const {
    const TriangleBlock& block = blocks_[i / 4];
    const auto vector = [&](const double(&from)[3][4]) {
      return DVec3(from[0][i % 4], from[1][i % 4], from[2][i % 4]);
    };
    const DVec3 a = vector(block.a);
    return {a, a + vector(block.ab), a + vector(block.ac)};
  }

  /// Distances of points from all triangles. Writes one row of padded_size() entries per point; entries from size() on
  /// are padding with very large distances.
  void distances(std::span<const DVec3> points, std::span<double* const> rows) const;
  size_t padded_size() const { return 4 * blocks_.size(); }

  /// Finds the nearest triangle to a triangle with corners A, B, C. The set must not be empty.
  /// @param a, b, c rows of distances() for A, B, C
  NearestTriangle nearest(const double* a, const double* b, const double* c) const;

private:
  TriangleBlock& next_block(uint32_t number, size_t& lane);

  std::vector<uint32_t> numbers_;
  std::vector<TriangleBlock> blocks_;
};

} // namespace packtrace
