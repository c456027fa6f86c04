#pragma once

#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Returns the linear colour of a hit: the material's texture at the hit, or its constant albedo.
/// @param material the triangle's material
/// @param barycentrics weights of the triangle's second and third vertex
Vec3 surface_albedo(const SceneSource& source, uint32_t geometry, uint32_t triangle, uint32_t material,
                    Vec2 barycentrics);

} // namespace packtrace
