#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/denoise/denoiser.h"
#include "runtime/trace/ray_tracer.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// One still view: how it is sampled over frames and how it is resolved.
struct RenderConfig {
  ImageSize size;            ///< of the result
  uint32_t supersample = 1;  ///< [1, 8]: traced and denoised at this multiple per axis, box-filtered at the end
  uint32_t frames = 32;      ///< [1, 65536]: each traces AoConfig::spp samples a pixel
  bool denoise = true;       ///< false: frames are averaged, nothing else
  bool only_if_seen = false; ///< stop behind the camera rays where none of them hits
  /// Above 0: fill the layers of RenderedImage about levels of detail. The error that was allowed, in traced pixels.
  double lod_error_px = 0.0;
  AoConfig ao;
  DenoiserConfig denoiser;
};

/// Throws Error(kUsage) naming the option that is out of range.
void validate(const RenderConfig& config);

/// Seconds of wall time, summed over frames.
struct RenderTimings {
  double build_s = 0;   ///< decode and BVH
  double primary_s = 0; ///< one frame: the view does not change
  double ao_s = 0;
  double denoise_s = 0;
};

/// What a view looks like, rows top to bottom. Pixels whose camera rays all miss: depth 0, instance kNoInstance, ao and
/// ao_raw kInvalidAo, rest 0. With supersampling every layer is the mean over the sub-pixels that hit, and instance
/// that of the first of them.
struct RenderedImage {
  ImageSize size;
  bool seen = true;            ///< false: no camera ray hits; with RenderConfig::only_if_seen all layers are empty then
  std::vector<float> ao;       ///< denoised, or the mean over all frames
  std::vector<float> ao_raw;   ///< of the last frame alone
  std::vector<float> depth;    ///< camera-space z, world units
  std::vector<float> coverage; ///< share of sub-pixels that hit something
  std::vector<Vec3> normal;    ///< world space
  std::vector<Vec3> albedo;    ///< linear sRGB
  std::vector<Vec3> shaded;    ///< albedo x ao, emitters as they are: the scene under an even sky, linear sRGB
  std::vector<uint32_t> instance;
  std::vector<uint32_t> lod;     ///< level of detail, of the last sub-pixel that hits; with RenderConfig::lod_error_px
  std::vector<uint32_t> cluster; ///< a number of the cluster there; the same
  std::vector<float> lod_error;  ///< largest bound of the distance from level 0, in traced pixels; the same
  double lod_error_px = 0.0;     ///< that was allowed
  RenderTimings timings;
  uint64_t ao_rays = 0;
  uint64_t primary_rays = 0;
};

/// What occlusion rays meet where that is coarser than what the camera sees; of the same instances.
struct Occluders {
  const SceneSource* source = nullptr;
  const RayTracer* tracer = nullptr; ///< built from source
  double error_px = 0.0;             ///< that surfaces may lie beside those that the camera sees; traced pixels
};

/// Called once, with what the camera sees. What it returns must live until render_view() is done.
using ChooseOccluders = std::function<Occluders(const GBuffer& seen, const PrimaryCamera& view)>;

/// Renders one camera. tracer must have been built from source.
/// The image depends on its arguments alone, not on the number of threads.
/// @param choose_occluders none: occlusion rays meet what camera rays do
/// Throws Error(kUsage) for a config out of range, Error(kCancelled), and what choose_occluders throws.
RenderedImage render_view(const SceneSource& source, const RayTracer& tracer, const Camera& camera,
                          const RenderConfig& config, Progress& progress, const ChooseOccluders& choose_occluders = {});

} // namespace packtrace
