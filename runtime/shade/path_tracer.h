#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/shade/shade_config.h"
#include "runtime/shade/shade_scene.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Radiance of one frame, linear sRGB, one entry per pixel.
struct ShadedFrame {
  ImageSize size;
  std::vector<Vec3> direct;   ///< from the surface itself: emission and light of the lights; the background at misses
  std::vector<Vec3> specular; ///< along reflections and transmissions
  std::vector<Vec3> ambient;  ///< diffuse albedo times the ambient radiance, not occluded
};

/// Numbers and length of the samples of a frame.
struct ShadeSamples {
  uint64_t seed = 0;
  uint64_t frame = 0;          ///< number of the frame in the pixels' sequences
  float ambient_radius = 1.0f; ///< world units: reach of the rays that occlude the ambient light behind mirrors
  float width_px = 1.0f;       ///< TextureFilter::width_px
};

/// Traces the paths of one frame: from each pixel's surface along mirror and transmission directions, with shadow rays
/// to the lights at each hit (docs/shading.md). The result is the same for any number of threads.
/// @param source, tracer those of the G-buffer's camera rays
/// @param scene of `source` or of the source that it shows levels of
/// @param camera the G-buffer's
/// @return number of rays. Throws Error(kCancelled).
uint64_t trace_shading(const SceneSource& source, const RayTracer& tracer, const ShadeScene& scene,
                       const PrimaryCamera& camera, const GBuffer& gbuffer, const ShadeConfig& config,
                       const ShadeSamples& samples, ShadedFrame& frame, Progress& progress);

} // namespace packtrace
