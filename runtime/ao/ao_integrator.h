#pragma once

#include <cstdint>

#include "pbrt_import/base/progress.h"
#include "runtime/ao/sampler.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Parameters of ambient occlusion. A hit at distance t darkens its direction by
///   occlusion = exp(-lambda x^2), x = t / radius, seen up to the distance x_end where it falls to `cutoff` (at most
///   1),
/// made continuous there as (exp(-lambda x^2) - exp(-lambda x_end^2)) / (1 - exp(-lambda x_end^2)): 1 at the surface,
/// 0 at the end. The sample is then 1 - (1 - min_visibility) occlusion, and a miss is 1.
/// With interreflection rho the sample k of a hit becomes k / (1 - rho L (1 - k)), L the hit surface's luminance.
struct AoConfig {
  float radius = 1.0f;          ///< world units, > 0; see default_ao_radius()
  uint32_t spp = 1;             ///< samples per pixel and frame, 1..65536
  bool falloff = true;          ///< false: every hit within radius occludes fully
  float lambda = 2.0f;          ///< 0..20
  float cutoff = 0.4f;          ///< 0..below 1
  bool continuous = true;       ///< false: occlusion steps down at x_end instead of fading to zero
  float min_visibility = 0.0f;  ///< 0..1: what full occlusion leaves
  float interreflection = 0.0f; ///< rho, 0..1; 0: off
  uint64_t seed = 0;
  SamplerKind sampler = SamplerKind::kSpaceTimeNet;
};

/// A radius for scenes whose units are not known: 10 % of the diagonal; 1 for boxes without extent.
float default_ao_radius(const Bounds& bounds);

/// Throws Error(kUsage) naming the first parameter out of range.
void validate(const AoConfig& config);

/// Ambient occlusion for every hit of a G-buffer.
///
/// Directions are cosine-weighted about the shading normal; those below the geometric surface are mirrored up at it, so
/// that an open surface has AO 1 whatever its vertex normals. Rays start `offset` above the surface, with tnear 0.
/// Without falloff and interreflection any hit ends a ray; distances are then unknown, and an occluded sample counts
/// as half the radius in hit_distance.
/// Sample frame_index * spp + i of a pixel's sequence is sample i of this frame. AO is in [min_visibility, 1], or
/// kInvalidAo (distance 0) where the camera ray missed. The result is the same for any number of threads.
/// @param gbuffer of this source and tracer; ao is resized to it
/// @param progress advances by the image's pixels, a tile at a time; its phase is begun by the caller, for one frame or
///        for many
/// Throws Error(kUsage) as validate() does, Error(kCancelled).
void trace_ao(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer, const AoConfig& config,
              uint32_t frame_index, AoFrame& ao, Progress& progress);

} // namespace packtrace
