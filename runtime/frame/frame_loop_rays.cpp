#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "runtime/ao/view_occlusion.h"
#include "runtime/camera/deformed_past.h"
#include "runtime/camera/device_surfaces.h"
#include "runtime/camera/origin_lift.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/frame/pixel_sums.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Frames of a still view that share an offset of the camera rays. With 32 frames, 2 give as good images as 1 and half
/// as many camera rays; 4 lose 0.5 to 1 dB (docs/denoiser.md).
constexpr uint32_t kFramesPerOffset = 2;

} // namespace

glm::dvec2 jitter_offset(uint32_t frame) {
  const auto offset = [&](uint32_t base) {
    double inverse = 0.0, digit = 1.0;
    for (uint32_t n = frame; n > 0; n /= base) inverse += (digit /= base) * (n % base);
    return inverse < 0.5 ? inverse : inverse - 1.0;
  };
  return {offset(3), offset(5)};
}

/// Side of the square of the image that a camera ray covers in the textures' filter. Camera rays of a still view
/// share the pixel, so that its mean is as sharp as that of points.
float FrameLoop::footprint_px() const {
  if (!config_.jitters()) return 1.0f;
  const uint32_t rounds = still_frames_ / kFramesPerOffset + 1; // of offsets, this one included
  return 1.0f / std::sqrt(static_cast<float>(rounds));
}

/// Whether camera rays are traced in a frame, counted from the last that moved.
bool FrameLoop::traces(uint32_t still_frame) const {
  return still_frame == 0 || (config_.jitters() && still_frame % kFramesPerOffset == 0);
}

PrimaryCamera FrameLoop::view_of(const Camera& camera, uint32_t still_frame) const {
  const glm::dvec2 offset = config_.jitters() ? jitter_offset(still_frame / kFramesPerOffset) : glm::dvec2(0.0);
  return {camera, config_.traced_size(), offset};
}

/// Traces the camera rays into gbuffer_. Their tiles do not count in the progress, but it can cancel them.
void FrameLoop::trace_camera_rays(const PrimaryCamera& view, Progress& progress) {
  const bool levels = config_.detail.camera_uses_levels();
  if (levels && report_.moved) state_.choose_detail(view, nullptr, report_);
  if (!levels) state_.build_level_0(report_);
  const RayTracer& tracer = *tracers().front();
  Progress unseen([&progress](std::string_view, uint64_t, uint64_t) { progress.advance(0); });
  const Stopwatch tracing;
  const bool moved_on = report_.moved && view_; // not the first frame
  std::optional<DeformedPast> surfaces;
  if (const PackedTracer* deforming = state_.deforming_tracer(); moved_on && deforming != nullptr)
    surfaces.emplace(*deforming);
  const PreviousFrame before{moved_on ? *view_ : view,
                             moved_on ? state_.previous_transforms() : std::span<const Affine>(),
                             surfaces ? &*surfaces : nullptr};
  gbuffer_.keep_channels(channels_);
  gbuffer_.points_may_stay_on_gpu = leaves_samples_on_gpu() && config_.ao_rate != AoRate::kAdaptive &&
                                    traces_view_occlusion(config_.ao, {}) && state_.moved_boxes().empty() &&
                                    !config_.proxy_beyond_px;
  gbuffer_.guides_may_stay_on_gpu = gbuffer_.points_may_stay_on_gpu && report_.moved && !reads_surfaces();
  const TextureFilter textures{
      config_.shades() ? &shading_.prepare(*scene().source, scene().memory).textures() : nullptr, footprint_px()};
  trace_primary(state_.camera_source(), tracer, view, before, gbuffer_, unseen, textures);
  traced_view_.emplace(view);
  report_.times.primary_s = tracing.seconds();
  report_.primary_rays = gbuffer_.size.pixels();
  report_.hit_pixels = count_hits(gbuffer_);
  if (config_.proxy_beyond_px && report_.moved)
    state_.choose_proxies(view, gbuffer_, *config_.proxy_beyond_px, config_.proxy_error, config_.ao, report_);
  if (config_.detail.only_occlusion && detail() != nullptr) {
    if (report_.moved) state_.choose_detail(view, &gbuffer_, report_);
    const Stopwatch lifting;
    lift_origins(*tracers().back(), view, *config_.detail.error_px, gbuffer_, unseen);
    report_.times.ao_s += lifting.seconds();
  }
  if (config_.ao_resolution == AoResolution::kQuarter) {
    const Stopwatch halving;
    half_ = halve(gbuffer_);
    report_.times.upsample_s += halving.seconds();
  }
}

/// Traces the camera rays of still frames 0 to `frames` again and adds them to the layers.
/// @param plans whether frame 0 chooses levels of detail, as a frame that moves does
void FrameLoop::trace_still(const Camera& camera, uint32_t frames, bool plans) {
  layers_.clear();
  Progress unseen;
  for (still_frames_ = 0;; ++still_frames_) {
    report_.moved = plans && still_frames_ == 0;
    if (traces(still_frames_)) {
      if (still_frames_ > 0) keep_layers();
      const PrimaryCamera view = view_of(camera, still_frames_);
      trace_camera_rays(view, unseen);
      layers_.add(gbuffer_, scene().source->materials());
      if (plans && config_.lod_layers) add_lod_layers(view);
    }
    if (still_frames_ == frames) break;
  }
}

/// Whether layers or settings need depths, normals or motion of each moving frame on the host.
bool FrameLoop::reads_surfaces() const {
  return config_.plain_layers != 0 || config_.view_layers || config_.surface_layers || config_.cost_layers ||
         config_.lod_layers || config_.shades() || config_.supersample != 1 || config_.proxy_beyond_px ||
         config_.detail.only_occlusion;
}

/// Fills in the arrays of the G-buffer that stayed on the GPU.
void FrameLoop::read_surfaces() {
  if (!gbuffer_.guides_on_gpu) return;
  read_device_guides(dynamic_cast<const ViewTracer&>(*tracers().front()), gbuffer_);
  if (still_frames_ > 0) gbuffer_.forget_motion();
}

/// Keeps the first frame's layers, to which further frames of the view will be added.
void FrameLoop::keep_layers() {
  read_surfaces();
  layers_.keep(gbuffer_);
}

/// Whether ambient occlusion stays on the GPU that traces it, for the denoiser there.
bool FrameLoop::leaves_samples_on_gpu() const {
  return config_.denoise && config_.ao_resolution == AoResolution::kFull && scene().backend.backend == Backend::kGpu;
}

/// The G-buffer from whose points occlusion rays start.
const GBuffer& FrameLoop::shaded_surfaces() const {
  return config_.ao_resolution == AoResolution::kQuarter ? half_.gbuffer : gbuffer_;
}

/// Traces the camera rays again if the G-buffer lacks channels that are needed now.
/// @param points whether the points from which occlusion rays start are needed, too
void FrameLoop::require_surfaces(bool points) {
  const uint32_t needed = channels_ | gbuffer_channels(config_);
  if (!camera_ || (needed == channels_ && (!points || shaded_surfaces().has_points()))) return;
  channels_ = needed;
  const FrameReport report = report_;
  trace_still(*camera_, still_frames_, false);
  report_ = report;
}

std::optional<CameraHit> FrameLoop::hit_at(uint32_t x, uint32_t y) const {
  return trace_pixel(state_.camera_source(), *tracers().front(), *traced_view_, x, y);
}

} // namespace packtrace
