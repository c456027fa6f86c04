#pragma once

#include <cstdint>
#include <optional>

#include "pbrt_import/scene/image_size.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/denoise/denoiser_config.h"
#include "runtime/image/tone_map.h"
#include "runtime/lod/sharing_config.h"
#include "runtime/shade/shade_config.h"

namespace packtrace {

/// Pixels for which occlusion rays are traced.
enum class AoResolution : uint8_t {
  kFull,
  kQuarter, ///< one of 2 x 2 pixels; the denoised result is upsampled (runtime/ao/half_resolution.h)
};

/// Pixels that get samples in a frame.
enum class AoRate : uint8_t {
  kFull,
  kCheckerboard, ///< every other pixel, alternating from frame to frame
  kAdaptive,     ///< more for surfaces that recently came into view, fewer for others (runtime/ao/adaptive_rate.h)
};

/// Images that a frame computes besides ambient occlusion.
enum class FrameView : uint8_t {
  kAo,
  kPbr,   ///< shading, with ambient light that nothing occludes (docs/shading.md)
  kPbrAo, ///< shading, with ambient occlusion
};

/// Layers of RenderedImage that may be omitted to save memory.
enum PlainLayer : uint32_t {
  kAoRawLayer = 1,
  kDepthLayer = 2,
  kNormalLayer = 4,
  kAlbedoLayer = 8,
  kShadedLayer = 16,
  kInstanceLayer = 32,
  kAllPlainLayers = 63,
};

/// Which levels of detail the rays of a frame meet (docs/lod_runtime.md).
struct DetailConfig {
  /// Maximum screen-space error in traced pixels, in (0, 1e9]. Unset: level 0 everywhere.
  std::optional<double> error_px;
  /// Camera rays meet level 0, and only occlusion rays meet coarser levels.
  bool only_occlusion = false;
  /// SharingConfig::culled_error_scale applies to the instances that no pixel shows, not to those outside the view.
  /// Requires only_occlusion, because the camera rays must be traced before the levels are chosen.
  bool cull_invisible = false;
  SharingConfig sharing;

  bool camera_uses_levels() const { return error_px && !only_occlusion; }
  /// Throws Error(kUsage) naming the option that is out of range.
  void validate() const;
};

/// Settings of a FrameLoop.
struct FrameConfig {
  ImageSize size;           ///< size of the result in pixels
  uint32_t supersample = 1; ///< [1, 8]: factor per axis at which the view is traced and denoised, then box-filtered
  bool denoise = true;      ///< false: raw frames are averaged while nothing moves
  /// Shifts the camera rays of each frame within their pixels while nothing moves, so that the image converges to an
  /// antialiased one. Has no effect with AoResolution::kQuarter.
  bool jitter = true;
  AoResolution ao_resolution = AoResolution::kFull;
  AoRate ao_rate = AoRate::kFull;
  bool lod_layers = false;                 ///< fill the LOD layers of RenderedImage
  uint32_t plain_layers = kAllPlainLayers; ///< bits of PlainLayer: layers to fill besides ao and coverage
  bool view_layers = false;                ///< fill its views of intermediate results
  bool surface_layers = false;             ///< fill its material flags and clusters
  bool cost_layers = false;                ///< fill what its camera rays visit; needs the packed tracer
  bool all_channels = true;                ///< FrameLoop::gbuffer() has all channels, not only those of the layers
  FrameView view = FrameView::kAo;
  ShadeConfig shade; ///< of the other views
  // How shaded layers are displayed. No frame depends on it.
  ToneMap tone_map = ToneMap::kSrgb;
  float exposure = 0.0f; ///< stops, [-32, 32]
  AoConfig ao;
  DenoiserConfig denoiser;
  DetailConfig detail;
  /// Size in pixels, > 0, below which occlusion rays meet an instance's voxels in place of its triangles, where that is
  /// faster (ProxyChoice). Unset: always triangles. Not with levels of detail, interreflection or things that move.
  std::optional<double> proxy_beyond_px;
  double proxy_error =
      0.01; ///< [0..1]: largest mean error of ambient occlusion with which voxels are used (proxy_error())

  bool shades() const { return view != FrameView::kAo; }
  Exposure display() const { return {tone_map, exposure}; }
  bool jitters() const { return jitter && ao_resolution == AoResolution::kFull; }
  /// Size at which rays are traced.
  ImageSize traced_size() const { return {size.width * supersample, size.height * supersample}; }
  /// Throws Error(kUsage) naming the option that is out of range.
  void validate() const;
};

/// Returns the channels of the G-buffer (bits of GBufferChannel) that the configured layers and outputs need.
uint32_t gbuffer_channels(const FrameConfig& config);

/// Approximate memory of the G-buffer, the denoiser and the layers of a view.
uint64_t picture_bytes(const FrameConfig& config);

} // namespace packtrace
