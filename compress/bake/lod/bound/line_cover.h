#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Finds which degenerate triangles, with two corners at one position, coincide with a side or corner of a proper
/// triangle. Those are part of the surface anyway and need no measurement of their own.
class LineCover {
public:
  LineCover() = default;
  /// @param triangles vertex numbers
  LineCover(std::span<const Triangle> triangles, std::span<const QuantizedVertex> vertices, size_t position_count);

  /// Whether a side or corner of a proper triangle covers the line.
  /// @param line position numbers of its corners, at least two of them equal
  bool holds(const Triangle& line) const;

private:
  /// sides and corners of proper triangles that are lines too; sorted
  std::vector<std::pair<uint32_t, uint32_t>> sides_;
};

} // namespace packtrace
