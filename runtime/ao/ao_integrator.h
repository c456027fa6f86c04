#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "pbrt_import/base/progress.h"
#include "runtime/ao/ao_config.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// The samples that the pixels of a frame get.
struct SamplePlan {
  uint32_t first = 0; ///< number of each pixel's first sample in its sequence
  uint32_t count = 1; ///< samples per pixel
  /// Only the pixels of one colour of a checkerboard get samples: those with (x + y) % 2 == colour.
  std::optional<uint32_t> colour;
  /// If not empty, one number per pixel in place of `first` and `count`. A pixel may get no sample.
  std::span<const uint32_t> pixel_first;
  std::span<const uint16_t> pixel_count;
};

/// Traces ambient occlusion for the hit pixels of a G-buffer.
///
/// Directions are cosine-weighted about the shading normal. Directions below the geometric surface are mirrored to its
/// upper side, so an unoccluded surface has AO 1 for any shading normal. Rays start at GBuffer::offset above the
/// surface, with tnear 0.
/// If falloff and interreflection are both off, any-hit queries suffice. Hit distances are then unknown, and an
/// occluded sample adds half the radius to hit_distance.
/// AO lies in [min_visibility, 1]; pixels whose camera ray missed and pixels without a sample get kInvalidAo and
/// distance 0. The result does not depend on the number of threads.
/// @param gbuffer traced with the same source and tracer, or with a finer version of the same instances
/// @param ao resized to the G-buffer; without limits of the history
/// @param progress advances by the number of pixels, tile by tile. The caller begins the phase, which may span several
///        frames.
/// @return the number of rays
/// Throws Error(kUsage) as validate() does, Error(kCancelled).
uint64_t trace_ao(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer, const AoConfig& config,
                  const SamplePlan& plan, AoFrame& ao, Progress& progress);

/// The same with config.spp samples for every pixel. Sample i of this frame is sample frame_index * spp + i of the
/// pixel's sequence.
inline uint64_t trace_ao(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer,
                         const AoConfig& config, uint32_t frame_index, AoFrame& ao, Progress& progress) {
  return trace_ao(source, tracer, gbuffer, config, SamplePlan{frame_index * config.spp, config.spp, {}, {}, {}}, ao,
                  progress);
}

} // namespace packtrace
