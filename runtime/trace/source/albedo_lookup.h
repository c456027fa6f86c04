#pragma once

#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Linear colour of a hit: the material's texture there, or the material's albedo.
/// @param material that of the triangle
Vec3 surface_albedo(const SceneSource& source, uint32_t geometry, uint32_t triangle, uint32_t material,
                    Vec2 barycentrics);

} // namespace packtrace
