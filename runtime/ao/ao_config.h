#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/base/setting.h"
#include "pbrt_import/scene/bounds.h"
#include "runtime/ao/sampler.h"

namespace packtrace {

/// Parameters of ambient occlusion; ao_settings() has their ranges. A hit at distance t, with x = t / radius, has
///   occlusion(x) = exp(-lambda x^2)  for x <= x_end, 0 beyond,
/// where x_end = min(1, the x at which occlusion falls to `cutoff`). With `continuous` the curve is rescaled so that
/// it reaches 0 at x_end:
///   (exp(-lambda x^2) - exp(-lambda x_end^2)) / (1 - exp(-lambda x_end^2)).
/// The visibility of a hit is k = 1 - (1 - min_visibility) occlusion; the visibility of a miss is 1.
/// Interreflection rho brightens a hit to k / (1 - rho L (1 - k)), where L is the luminance of the hit's albedo.
struct AoConfig {
  float radius = 0.0f;          ///< world units, finite; 0: relative_radius times the diagonal of the scene's bounds
  float relative_radius = 0.1f; ///< [1e-6..100]; used if radius is 0
  uint32_t spp = 1;             ///< samples per pixel and frame, [1..65536]
  bool falloff = true;          ///< false: every hit within radius occludes fully
  float lambda = 2.0f;          ///< [0..20]
  float cutoff = 0.4f;          ///< [0..1]
  bool continuous = true;       ///< false: occlusion drops from `cutoff` to 0 at x_end instead of fading out
  float min_visibility = 0.0f;  ///< [0..1]: visibility of a fully occluded sample
  float interreflection = 0.0f; ///< rho, [0..1]; 0: off
  float offset_scale = 1.0f;    ///< [0..1000]: factor of GBuffer::offset; below 1, surfaces may occlude themselves
  uint64_t seed = 0;
  SamplerKind sampler = SamplerKind::kSpaceTimeNet;
  uint32_t sampler_block = 8; ///< [1..8]: side of the blocks of SamplerKind::kMultiJitter
  bool sort_rays = false;     ///< trace the rays of 64 x 128 pixels in order of their directions; results are the same
};

/// Returns AoConfig::radius, or its default for a scene with these bounds; 1 if the diagonal is zero or not finite.
float ao_radius(const AoConfig& config, const Bounds& bounds);

/// The numbers and switches of AoConfig, but its seed.
std::span<const Setting<AoConfig>> ao_settings();

/// Throws Error(kUsage) naming the first parameter out of range, its value and the range.
void validate(const AoConfig& config);

} // namespace packtrace
