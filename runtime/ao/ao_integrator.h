#pragma once

#include <cstdint>

#include "pbrt_import/base/progress.h"
#include "runtime/ao/sampler.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Parameters of ambient occlusion. A hit at distance t, with x = t / radius, has
///   occlusion(x) = exp(-lambda x^2)  for x <= x_end, 0 beyond,
/// where x_end = min(1, the x at which occlusion falls to `cutoff`). With `continuous` the curve is rescaled so that
/// it reaches 0 at x_end:
///   (exp(-lambda x^2) - exp(-lambda x_end^2)) / (1 - exp(-lambda x_end^2)).
/// The visibility of a hit is k = 1 - (1 - min_visibility) occlusion; the visibility of a miss is 1.
/// Interreflection rho brightens a hit to k / (1 - rho L (1 - k)), where L is the luminance of the hit's albedo.
struct AoConfig {
  float radius = 1.0f;          ///< world units, > 0; see default_ao_radius()
  uint32_t spp = 1;             ///< samples per pixel and frame, 1..65536
  bool falloff = true;          ///< false: every hit within radius occludes fully
  float lambda = 2.0f;          ///< 0..20
  float cutoff = 0.4f;          ///< [0, 1)
  bool continuous = true;       ///< false: occlusion drops from `cutoff` to 0 at x_end instead of fading out
  float min_visibility = 0.0f;  ///< 0..1: visibility of a fully occluded sample
  float interreflection = 0.0f; ///< rho, 0..1; 0: off
  uint64_t seed = 0;
  SamplerKind sampler = SamplerKind::kSpaceTimeNet;
};

/// Returns a radius for scenes with unknown units: 10 % of the bounds' diagonal, or 1 if the diagonal is zero or not
/// finite.
float default_ao_radius(const Bounds& bounds);

/// Throws Error(kUsage) naming the first parameter out of range.
void validate(const AoConfig& config);

/// Traces ambient occlusion for every hit pixel of a G-buffer.
///
/// Directions are cosine-weighted about the shading normal. Directions below the geometric surface are mirrored to its
/// upper side, so an unoccluded surface has AO 1 for any shading normal. Rays start at GBuffer::offset above the
/// surface, with tnear 0.
/// If falloff and interreflection are both off, any-hit queries suffice. Hit distances are then unknown, and an
/// occluded sample adds half the radius to hit_distance.
/// Sample i of this frame is sample frame_index * spp + i of the pixel's sequence. AO lies in [min_visibility, 1];
/// pixels whose camera ray missed get kInvalidAo and distance 0. The result does not depend on the number of threads.
/// @param gbuffer traced with the same source and tracer, or with a finer version of the same instances
/// @param ao resized to the G-buffer
/// @param progress advances by the number of pixels, tile by tile. The caller begins the phase, which may span several
///        frames.
/// Throws Error(kUsage) as validate() does, Error(kCancelled).
void trace_ao(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer, const AoConfig& config,
              uint32_t frame_index, AoFrame& ao, Progress& progress);

} // namespace packtrace
