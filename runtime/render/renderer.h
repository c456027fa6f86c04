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

/// Pixels for which occlusion rays are traced.
enum class AoResolution : uint8_t {
  kFull,
  kQuarter, ///< one of 2 x 2 pixels; the denoised result is upsampled (runtime/ao/half_resolution.h)
};

/// Settings for rendering one still view.
struct RenderConfig {
  ImageSize size;           ///< size of the result in pixels
  uint32_t supersample = 1; ///< [1, 8]: factor per axis at which the view is traced and denoised, then box-filtered
  uint32_t frames = 32;     ///< [1, 65536]: each frame traces AoConfig::spp samples per pixel
  bool denoise = true;      ///< false: raw frames are averaged
  AoResolution ao_resolution = AoResolution::kFull;
  bool stop_if_nothing_visible = false; ///< return after the camera rays if all of them miss
  bool lod_layers = false;              ///< fill the LOD layers of RenderedImage
  AoConfig ao;
  DenoiserConfig denoiser;
};

/// Throws Error(kUsage) naming the option that is out of range.
void validate(const RenderConfig& config);

/// Wall time in seconds, summed over frames.
struct RenderTimings {
  double build_s = 0;   ///< decoding and BVH construction
  double primary_s = 0; ///< camera rays; traced once, since the view does not change
  double ao_s = 0;
  double denoise_s = 0;
  double upsample_s = 0; ///< of AO traced at a lower resolution, and selecting its pixels; once per view
};

/// Layers of a rendered view, rows top to bottom, one entry per pixel. Where all camera rays of a pixel miss, ao and
/// ao_raw are kInvalidAo, instance is kNoInstance and all other layers are 0. With supersampling, layers are means over
/// the sub-pixels that hit unless stated otherwise; instance is that of the first sub-pixel that hits.
struct RenderedImage {
  ImageSize size;
  bool seen =
      true; ///< false: all camera rays miss; with RenderConfig::stop_if_nothing_visible all layers are then empty
  std::vector<float> ao;       ///< denoised; without the denoiser the mean over all frames
  std::vector<float> ao_raw;   ///< AO of the last frame alone, not denoised
  std::vector<float> depth;    ///< camera-space z, world units
  std::vector<float> coverage; ///< fraction of sub-pixels whose camera ray hits, [0, 1]
  std::vector<Vec3> normal;    ///< world space
  std::vector<Vec3> albedo;    ///< linear sRGB
  std::vector<Vec3> shaded;    ///< albedo times ao, as under a uniform white sky; emitters are white; linear sRGB
  std::vector<uint32_t> instance;
  // The LOD layers are empty unless RenderConfig::lod_layers is set.
  std::vector<uint32_t> lod;     ///< LOD level at the last sub-pixel that hits
  std::vector<uint32_t> cluster; ///< cluster number at the last sub-pixel that hits
  std::vector<float> lod_error;  ///< largest error bound (distance from level 0) of the sub-pixels, in traced pixels
  RenderTimings timings;
  uint64_t ao_rays = 0;
  uint64_t primary_rays = 0;
};

/// The geometry that occlusion rays are traced against: a coarser version of the instances that the camera sees.
struct Occluders {
  const SceneSource* source = nullptr;
  const RayTracer* tracer = nullptr; ///< built from source
  double error_px = 0.0;             ///< bound of the distance from the surfaces that the camera sees, in traced pixels
};

/// Called once, after the camera rays. `seen` is their G-buffer. The source and the tracer it returns must outlive
/// render_view().
using ChooseOccluders = std::function<Occluders(const GBuffer& seen, const PrimaryCamera& view)>;

/// Renders one camera. The image does not depend on the number of threads.
/// @param tracer built from source
/// @param choose_occluders optional; without it occlusion rays use source and tracer
/// Throws Error(kUsage) for settings out of range, Error(kCancelled), and whatever choose_occluders throws.
RenderedImage render_view(const SceneSource& source, const RayTracer& tracer, const Camera& camera,
                          const RenderConfig& config, Progress& progress, const ChooseOccluders& choose_occluders = {});

} // namespace packtrace
