#pragma once

#include <span>

#include "compress/bake/clusters/normal_quantizer.h"
#include "compress/bake/grid/welded_surface.h"

namespace packtrace {

/// Estimated bits of one vertex in a cluster.
struct VertexBits {
  double position = 0.0, normal = 0.0;
};

/// Decides which flat triangles go without normals. Such triangles need clusters of their own: vertices that only they
/// use save their normals, but vertices on the border of a flat region are stored twice. A region is the flat triangles
/// that are connected by positions. It keeps its flags if that is estimated to save bits; else its triangles count as
/// smooth. Depends on the input only, not on the thread count.
/// @param parts with normals and flags of flat triangles; parts without normals stay as they are
void choose_flat_regions(std::span<QuantizedPart> parts, const WeldedSurface& surface, const VertexBits& bits);

} // namespace packtrace
