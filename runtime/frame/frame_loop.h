#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/ao/adaptive_rate.h"
#include "runtime/ao/half_resolution.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/denoise/denoiser.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/frame_report.h"
#include "runtime/frame/frame_shading.h"
#include "runtime/frame/mean_layers.h"
#include "runtime/frame/raw_mean.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/frame/scene_state.h"
#include "runtime/frame/view_layers.h"

namespace packtrace {

/// Renders a scene frame by frame: detail, camera rays, occlusion rays, denoising. It keeps the state that the next
/// frame needs: history, trees, and, while nothing moves, the sums that antialias the image.
///
/// Windows, sequences and still pictures all use this class. Frames depend only on the settings and on the states of
/// all frames since reset(), not on the number of threads.
class FrameLoop {
public:
  /// Throws Error(kUsage) for settings out of range, or a detail without a file; Error(kUnsupported) for shading
  /// without SceneSource::has_shading().
  FrameLoop(const FrameScene& scene, const FrameConfig& config);
  ~FrameLoop();

  /// Renders the next frame.
  /// @param time_s time of FrameScene::motion in seconds
  /// @param progress advances by frame_pixels(); the caller begins the phase
  /// Throws Error(kInput) for a camera without rays, Error(kCancelled), and what building trees throws. A frame that
  /// was cancelled leaves no trace in the history, but call reset() if the scene moves, or before a still view
  /// continues.
  const FrameReport& next_frame(const Camera& camera, double time_s, Progress& progress);

  /// Sets whether the next frames are expected to move. Data that only a still picture needs is then freed: less
  /// memory, same results. A frame that does not move although expected to takes longer.
  void expect_movement(bool expected) { expects_movement_ = expected; }

  /// Writes the layers of the frames so far.
  /// Throws Error(kUnsupported) for FrameConfig::cost_layers without the packed tracer.
  /// @param report mean_history is set, and the denoiser's and the resolve's times are added
  void resolve(RenderedImage& image, PictureReport& report);

  /// Returns the state that the next frame needs, for restore().
  std::vector<std::byte> save() const;
  /// Continues where a frame loop with the same scene and configuration was saved.
  /// @param camera, time_s those of the last frame
  /// Throws Error(kInput) for bytes that save() did not write, and as next_frame() does.
  void restore(const Camera& camera, double time_s, std::span<const std::byte> bytes);

  /// Continues with other settings, whose `detail` is ignored: levels of detail do not change. Discards all frames;
  /// keeps the trees. Throws as the constructor does.
  void configure(const FrameConfig& config);
  /// Sets which layers are filled and which shaded view is resolved. Plain, surface and cost layers are filled from the
  /// next resolve() on, views from the next frame on. Traces the camera rays again where the G-buffer lacks what the
  /// layers need. Keeps the history.
  void show_layers(const FrameConfig& config);

  /// SceneState::follow_motion().
  bool follow_motion(const SceneMotion& motion) { return state_.follow_motion(motion); }
  /// Changes the direction of the lights (ShadeConfig::light_turn). Occlusion is kept. Shading restarts without a
  /// denoiser; with one its means continue for a few frames (ShadedHistory::kChanged).
  void turn_lights(float degrees);

  /// Number of occlusion pixels per frame.
  uint64_t frame_pixels() const;

  /// Discards all frames: the next one is number 0.
  void reset();

  const FrameConfig& config() const { return config_; }
  const FrameScene& scene() const { return state_.scene(); }
  /// The source and the tracers in use: the camera's, and with only_occlusion also the occlusion rays'.
  const SceneSource& traced_source() const { return state_.traced_source(); }
  std::vector<const RayTracer*> tracers() const { return state_.tracers(); }
  /// SceneState::proxy_error().
  std::optional<double> proxy_error() const { return state_.proxy_error(); }
  /// The lights and materials of shaded views; null before the first frame of one.
  const ShadeScene* shade_scene() const { return shading_.scene(); }
  const DetailPlanner* detail() const { return state_.planner(); }
  const AoDenoiser& denoiser() const { return denoiser_; }
  /// The G-buffer of the last frame that traced camera rays. Reads arrays that stayed on a GPU.
  const GBuffer& gbuffer() {
    read_surfaces();
    return gbuffer_;
  }
  /// Traces the camera ray of a pixel of the last traced frame again and returns its hit. Needs a frame.
  std::optional<CameraHit> hit_at(uint32_t x, uint32_t y) const;

private:
  void trace_camera_rays(const PrimaryCamera& view, Progress& progress);
  void trace_still(const Camera& camera, uint32_t frames, bool plans);
  void require_surfaces(bool points);
  bool reads_surfaces() const;
  void read_surfaces();
  void keep_layers();
  bool leaves_samples_on_gpu() const;
  const GBuffer& shaded_surfaces() const;
  PrimaryCamera view_of(const Camera& camera, uint32_t still_frame) const;
  bool traces(uint32_t still_frame) const;
  float footprint_px() const;
  SamplePlan sample_plan(const GBuffer& shaded, std::span<const float> limits);
  void accumulate(const GBuffer& shaded);
  void add_lod_layers(const PrimaryCamera& view);
  void shade_frame(bool changed, Progress& progress);
  void resolve_shading(std::span<const float> ao, RenderedImage& image);
  std::span<const float> accumulated_ao(std::vector<float>& raw_mean, PictureReport& report);
  void read_samples();
  void resolve_views(RenderedImage& image);
  void resolve_surfaces(RenderedImage& image) const;

  FrameConfig config_;
  SceneState state_;
  std::optional<Camera> camera_; ///< of the previous frame
  std::optional<PrimaryCamera> view_;
  std::optional<PrimaryCamera> traced_view_; ///< of gbuffer_
  uint64_t next_number_ = 0;
  uint32_t still_frames_ = 0; ///< frames since something moved, without the first
  uint32_t channels_ = 0;     ///< of the G-buffers since something moved
  bool expects_movement_ = false;
  GBuffer gbuffer_, guides_;
  HalfGBuffer half_;
  AoFrame raw_;
  AoDenoiser denoiser_;
  AdaptiveRate adaptive_;
  RawMean raw_mean_;
  MeanLayers layers_;
  FrameShading shading_;
  RenderedImage lod_layers_; ///< only its LOD layers
  ViewLayers views_;
  const DenoisedAo* denoised_ = nullptr; ///< of the denoiser's last denoise(); null without denoiser
  FrameReport report_;
};

/// Offset of the camera rays of a still view's frame from pixel centres, in pixels within [-0.5, 0.5): points of the
/// Halton sequence in the bases 3 and 5, whose first is 0. The sampler of occlusion rays uses base 2, so that the
/// frames whose camera rays hit one side of an edge have well-distributed occlusion rays, too. (Points of the R2
/// sequence repeat almost every 4 frames and leave noise at edges.) Source: J. H. Halton, "On the efficiency of certain
/// quasi-random sequences of points", 1960.
glm::dvec2 jitter_offset(uint32_t frame);

} // namespace packtrace
