#pragma once

#include "runtime/trace/ray_tracer.h"
#include "runtime/trace/source/texture_pyramids.h"

namespace packtrace {

/// The footprint of a ray on a surface, in the tracer's space: the part within a cone about the ray. Source:
/// Amanatides, Ray Tracing with Cones, SIGGRAPH 1984.
struct RayFootprint {
  Vec3 direction; ///< of the ray, unit length
  Vec3 normal;    ///< geometric, unit length
  float width;    ///< of the cone at the hit; 0: a point
};

/// Filter of the colours that camera rays see.
struct TextureFilter {
  const TexturePyramids* pyramids = nullptr; ///< of the source; null: textures are looked up at points
  float width_px = 1.0f;                     ///< side of the square of the image that a camera ray covers
};

/// Returns the linear colour of a hit: the mean of the material's texture over the footprint, or its constant albedo.
/// @param pyramids of the source; null: the texture at the hit
/// @param material the triangle's material
/// @param barycentrics weights of the triangle's second and third vertex
Vec3 surface_albedo(const SceneSource& source, const TexturePyramids* pyramids, const HitSurface& surface,
                    uint32_t material, Vec2 barycentrics, const RayFootprint& footprint);

} // namespace packtrace
