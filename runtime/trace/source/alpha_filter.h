#pragma once

#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Returns false if an alpha mask removes the surface at a hit. kAlphaMask applies to all rays, kShadowAlphaMask to
/// occlusion rays only.
/// @param barycentrics weights of the triangle's second and third vertex
bool surface_present(const SceneSource& source, uint32_t instance, uint32_t triangle, Vec2 barycentrics,
                     bool occlusion_ray);

} // namespace packtrace
