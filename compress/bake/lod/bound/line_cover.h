#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Which triangles with two corners in one place, lines, are sides of triangles that are none: those are part of the
/// surface anyway, and what becomes of it is measured there.
class LineCover {
public:
  LineCover() = default;
  /// @param triangles of vertices
  LineCover(std::span<const Triangle> triangles, std::span<const QuantizedVertex> vertices, size_t position_count);

  /// @param line positions of its corners, at least two of them the same
  bool holds(const Triangle& line) const;

private:
  std::vector<std::pair<uint32_t, uint32_t>> sides_; ///< of lines, that are sides of triangles too; sorted
};

} // namespace packtrace
