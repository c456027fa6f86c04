#include "runtime/frame/frame_loop.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pbrt_import/base/error.h"
#include "runtime/ao/moved_occluders.h"
#include "runtime/camera/lod_view.h"
#include "runtime/frame/pixel_sums.h"
#include "runtime/frame/surface_layers.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/view_tracer.h"

namespace packtrace {
namespace {

FrameConfig validated(const FrameConfig& config, const FrameScene& scene) {
  config.validate();
  packtrace::validate(config.ao);
  if (config.shades() && !scene.source->has_shading())
    throw Error(ErrorKind::kUnsupported, "it holds no materials and lights for shading; bake it with --for shading");
  return config;
}

bool same_camera(const Camera& a, const Camera& b) {
  return a.projection == b.projection && a.world_from_camera == b.world_from_camera && a.fov_degrees == b.fov_degrees &&
         a.screen_window == b.screen_window && a.width_px == b.width_px && a.height_px == b.height_px;
}

/// Whether AoFrame::hit_distance is read.
bool needs_distances(const FrameConfig& config, const FrameScene& scene) {
  const bool reference = config.denoise && config.denoiser.kind == DenoiserKind::kReference;
  return config.view_layers || reference || scene.backend.backend == Backend::kGpu;
}

/// The denoiser works where rays are traced.
AoDenoiser made_denoiser(const FrameConfig& config, const FrameScene& scene) {
  const bool on_gpu = config.denoise && scene.backend.backend == Backend::kGpu;
  return AoDenoiser(config.denoiser, on_gpu ? &scene.backend.gpu : nullptr);
}

} // namespace

FrameLoop::FrameLoop(const FrameScene& scene, const FrameConfig& config)
    : config_(validated(config, scene)), state_(scene, config.detail), denoiser_(made_denoiser(config, scene)) {}

FrameLoop::~FrameLoop() = default;

void FrameLoop::reset() {
  camera_.reset();
  view_.reset();
  next_number_ = 0;
  state_.reset();
  denoiser_.reset();
  adaptive_.clear();
  shading_.clear();
}

void FrameLoop::configure(const FrameConfig& config) {
  const DetailConfig detail = config_.detail;
  config_ = validated(config, scene());
  config_.detail = detail;
  denoiser_ = made_denoiser(config_, scene());
  denoised_ = nullptr;
  views_.clear();
  reset();
}

uint64_t FrameLoop::frame_pixels() const {
  const ImageSize size = config_.traced_size();
  if (config_.ao_resolution == AoResolution::kFull) return size.pixels();
  return uint64_t{(size.width + 1) / 2} * ((size.height + 1) / 2);
}

/// Shades what the camera rays hit. Its tiles do not count in the progress, but it can cancel them.
/// @param changed something other than the camera has moved
void FrameLoop::shade_frame(bool changed, Progress& progress) {
  Progress unseen([&progress](std::string_view, uint64_t, uint64_t) { progress.advance(0); });
  const Stopwatch shading;
  const ShadeSamples samples{config_.ao.seed, next_number_, ao_radius(config_.ao, traced_source().world_bounds()),
                             footprint_px()};
  report_.shade_rays = shading_.add(
      {state_.camera_source(), *tracers().front(), *traced_view_, gbuffer_, samples, report_.moved, changed}, config_,
      unseen);
  report_.times.shade_s += shading.seconds();
}

/// Adds the level, cluster and screen-space error of the camera rays' hits.
void FrameLoop::add_lod_layers(const PrimaryCamera& view) {
  RenderedImage& image = lod_layers_;
  const SceneSource& source = traced_source();
  const size_t n = config_.size.pixels();
  if (still_frames_ == 0) image.lod.assign(n, 0), image.cluster.assign(n, 0), image.lod_error.assign(n, 0.0f);
  const GBuffer& g = gbuffer_;
  const uint32_t factor = config_.supersample;
  for (uint32_t y = 0; y < g.size.height; ++y)
    for (uint32_t x = 0; x < g.size.width; ++x) {
      const size_t in = static_cast<size_t>(y) * g.size.width + x;
      if (g.instance[in] == kNoInstance) continue;
      const size_t out = static_cast<size_t>(y / factor) * config_.size.width + x / factor;
      const SurfaceDetail detail = source.detail_of(g.instance[in], g.triangle[in]);
      const double error_px = error_in_pixels(view, DVec3(g.position[in]), static_cast<double>(detail.error_world));
      image.lod_error[out] = std::max(image.lod_error[out], static_cast<float>(error_px));
      image.lod[out] = detail.level, image.cluster[out] = detail.cluster;
    }
}

/// The samples of the next frame.
SamplePlan FrameLoop::sample_plan(const GBuffer& shaded, std::span<const float> limits) {
  if (config_.ao_rate == AoRate::kAdaptive) return adaptive_.next_frame(shaded, !report_.moved, config_.ao.spp, limits);
  SamplePlan plan;
  plan.count = config_.ao.spp;
  const auto frame = static_cast<uint32_t>(next_number_);
  plan.first = frame * plan.count;
  if (config_.ao_rate == AoRate::kCheckerboard) {
    plan.colour = frame % 2;
    plan.first = frame / 2 * plan.count; // each pixel takes the samples of its sequence one after another
  }
  return plan;
}

/// Adds the frame's occlusion to the history.
/// @param shaded the G-buffer from whose points its rays started
void FrameLoop::accumulate(const GBuffer& shaded) {
  const Stopwatch accumulating;
  if (!config_.denoise) {
    if (report_.moved) raw_mean_.clear();
    raw_mean_.add(raw_);
  } else if (config_.jitters() && !report_.moved) {
    read_surfaces();
    layers_.write_guides(gbuffer_, guides_);
    denoiser_.add_frame(guides_, raw_, HistorySource::kPixel);
  } else {
    denoiser_.add_frame(shaded, raw_, report_.moved ? HistorySource::kMotion : HistorySource::kUnchanged);
  }
  report_.times.denoise_s += accumulating.seconds();
}

const FrameReport& FrameLoop::next_frame(const Camera& camera, double time_s, Progress& progress) {
  const uint64_t last_hits = report_.hit_pixels; // stays unless camera rays are traced
  report_ = {};
  report_.number = next_number_, report_.hit_pixels = last_hits;
  const bool changed = state_.advance(DVec3(camera.world_from_camera[3]), time_s, report_);
  const bool moved = report_.moved = !view_ || changed || !same_camera(camera, *camera_);
  if (moved)
    channels_ = gbuffer_channels(config_);
  else
    require_surfaces(true);
  still_frames_ = moved ? 0 : still_frames_ + 1;

  const bool passing = moved && expects_movement_;
  if (passing) denoiser_.free_spare_memory();
  const bool trace = traces(still_frames_);
  const PrimaryCamera view = view_of(camera, still_frames_);
  if (trace && !moved) keep_layers();
  if (trace)
    trace_camera_rays(view, progress);
  else if (still_frames_ == 1)
    gbuffer_.forget_motion();
  report_.seen = report_.hit_pixels > 0;

  const bool quarter = config_.ao_resolution == AoResolution::kQuarter;
  if (quarter && still_frames_ == 1) half_.gbuffer.forget_motion();
  const GBuffer& shaded = shaded_surfaces();
  const Stopwatch limiting;
  std::vector<float> limits;
  if (moved && config_.denoise)
    limits =
        history_limits(state_.moved_boxes(), shaded, config_.ao, ao_radius(config_.ao, traced_source().world_bounds()));
  report_.times.denoise_s += limiting.seconds();
  const Stopwatch tracing;
  const SamplePlan plan = sample_plan(shaded, limits);
  raw_.with_distances = needs_distances(config_, scene());
  raw_.may_stay_on_gpu = leaves_samples_on_gpu();
  report_.ao_rays = trace_ao(traced_source(), *tracers().back(), shaded, config_.ao, plan, raw_, progress);
  raw_.max_history = std::move(limits);
  if (config_.jitters()) raw_.samples = 1;
  report_.times.ao_s += tracing.seconds();

  if (config_.shades()) shade_frame(changed, progress);

  const Stopwatch layering;
  if (moved) layers_.clear();
  if (trace) layers_.add(gbuffer_, scene().source->materials());
  if (trace && config_.lod_layers) add_lod_layers(view);
  if (moved && config_.view_layers) views_.keep_motion(gbuffer_);
  report_.times.resolve_s += layering.seconds();

  if (passing) (quarter ? half_.gbuffer : gbuffer_).forget_points();
  accumulate(shaded);
  camera_ = camera;
  view_.emplace(camera, config_.traced_size());
  ++next_number_;
  return report_;
}

/// The denoised AO, or the mean of the raw AO, of all traced pixels.
/// @param raw_mean memory for the latter
std::span<const float> FrameLoop::accumulated_ao(std::vector<float>& raw_mean, PictureReport& report) {
  const Stopwatch denoising;
  if (!config_.denoise) {
    const bool quarter = config_.ao_resolution == AoResolution::kQuarter;
    return raw_mean = raw_mean_.result(raw_.size, quarter ? half_.gbuffer.instance : layers_.instances(gbuffer_));
  }
  const DenoisedAo& denoised = denoiser_.denoise(config_.view_layers);
  denoised_ = &denoised;
  if (report_.moved && expects_movement_) denoiser_.free_spare_memory();
  report.times.denoise_s += denoising.seconds();
  report.mean_history = mean_history(denoised);
  return denoised.ao;
}

/// Writes the shaded layers, without noise if there is a denoiser.
void FrameLoop::resolve_shading(std::span<const float> ao, RenderedImage& image) {
  if (!config_.denoise) return shading_.resolve(config_, nullptr, ao, image);
  if (still_frames_ > 0) layers_.write_guides(gbuffer_, guides_);
  const GBuffer& mean = still_frames_ > 0 ? guides_ : gbuffer_;
  std::vector<Vec3> memory;
  const ShadedGuides guides{mean.size,
                            mean.view_z,
                            mean.normal,
                            mean.instance,
                            gbuffer_.material,
                            layers_.albedos(gbuffer_, memory),
                            static_cast<float>(still_frames_) + 1.0f};
  shading_.resolve(config_, &guides, ao, image);
}

/// Reads samples that stayed on a GPU, if a layer shows them.
void FrameLoop::read_samples() {
  if (!raw_.on_gpu || (!config_.view_layers && (config_.plain_layers & kAoRawLayer) == 0)) return;
  if (const auto* tracer = dynamic_cast<const ViewTracer*>(tracers().back()))
    tracer->read_occlusion(*raw_.on_gpu, raw_.ao, raw_.hit_distance);
}

/// Writes the views of the last frame; motion is that since the last image.
void FrameLoop::resolve_views(RenderedImage& image) {
  views_.resolve(config_, gbuffer_, raw_, denoised_, still_frames_ + 1, image);
  views_.clear();
}

/// Writes the layers about the camera rays' surfaces and costs.
void FrameLoop::resolve_surfaces(RenderedImage& image) const {
  if (config_.surface_layers) write_surface_layers(config_, gbuffer_, *scene().source, state_.camera_source(), image);
  if (!config_.cost_layers) return;
  const auto* packed = dynamic_cast<const PackedTracer*>(tracers().front());
  if (packed == nullptr)
    throw Error(ErrorKind::kUnsupported, std::string(kCostLayers[0]) + " and other costs require backend packed");
  write_cost_layers(config_, count_ray_costs(*packed, *traced_view_), image);
}

void FrameLoop::turn_lights(float degrees) {
  if (config_.shade.light_turn != degrees) shading_.turn_lights();
  config_.shade.light_turn = degrees;
}

void FrameLoop::show_layers(const FrameConfig& config) {
  config_.plain_layers = config.plain_layers, config_.view_layers = config.view_layers;
  config_.surface_layers = config.surface_layers, config_.cost_layers = config.cost_layers;
  if (config_.shades() && config.shades()) config_.view = config.view;
}

void FrameLoop::resolve(RenderedImage& image, PictureReport& report) {
  PassTimes& times = report.times;
  require_surfaces(false);
  if (reads_surfaces()) read_surfaces();
  read_samples();
  std::vector<float> raw_mean;
  const std::span<const float> ao = accumulated_ao(raw_mean, report);
  if (config_.ao_resolution == AoResolution::kQuarter) {
    const Stopwatch upsampling;
    std::array<std::vector<float>, 2> layers; // denoised, raw; the latter only if a layer shows it
    if ((config_.plain_layers & kAoRawLayer) != 0)
      layers = upsample_ao<2>(gbuffer_, half_, {ao, raw_.ao});
    else
      layers[0] = std::move(upsample_ao<1>(gbuffer_, half_, {ao})[0]);
    const auto& [full_ao, raw] = layers;
    times.upsample_s += upsampling.seconds();
    const Stopwatch filtering;
    layers_.resolve(config_, gbuffer_, full_ao, raw, image);
    if (config_.shades()) resolve_shading(full_ao, image);
    times.resolve_s += filtering.seconds();
  } else {
    const Stopwatch filtering;
    layers_.resolve(config_, gbuffer_, ao, raw_.ao, image);
    if (config_.shades()) resolve_shading(ao, image);
    times.resolve_s += filtering.seconds();
  }
  if (config_.view_layers) resolve_views(image);
  image.max_lod_error_px = config_.detail.error_px.value_or(0.0);
  image.lod = lod_layers_.lod, image.cluster = lod_layers_.cluster, image.lod_error = lod_layers_.lod_error;
  resolve_surfaces(image);
}

} // namespace packtrace
