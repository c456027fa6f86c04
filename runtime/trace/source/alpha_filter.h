#pragma once

#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// False where a masked surface is absent for this kind of ray: kAlphaMask counts for all rays, kShadowAlphaMask for
/// occlusion rays.
bool surface_present(const SceneSource& source, uint32_t instance, uint32_t triangle, Vec2 barycentrics,
                     bool occlusion_ray);

} // namespace packtrace
