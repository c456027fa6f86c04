#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Makes pbrt-v3's heightfield: nu x nv samples over the unit square, with two triangles per square, uv = xy and no
/// normals. Sample (x, y) is at (x / (nu - 1), y / (nv - 1), heights[y * nu + x]). Non-finite samples stay in the mesh;
/// clean_up_mesh() removes the triangles that touch them.
/// Throws Error(kInput) if nu or nv is below 2 or heights does not have nu * nv samples.
Mesh make_heightfield(uint32_t nu, uint32_t nv, std::span<const float> heights);

} // namespace packtrace
