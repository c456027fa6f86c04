#include "runtime/render/renderer.h"

#include <algorithm>
#include <string>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/ao/half_resolution.h"
#include "runtime/camera/lod_view.h"
#include "runtime/camera/origin_lift.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxSupersample = 8;
constexpr uint32_t kMaxFrames = 65536;
constexpr uint32_t kMaxTracedSide = 1u << 16;
constexpr size_t kMaxTracedPixels = size_t{1} << 28;

void require(bool condition, const std::string& message) {
  if (!condition) throw Error(ErrorKind::kUsage, message);
}

ImageSize traced_size(const RenderConfig& config) {
  return {config.size.width * config.supersample, config.size.height * config.supersample};
}

/// Accumulates the mean of raw AO over frames, for renders without the denoiser.
class FrameMean {
public:
  void add(const AoFrame& frame) {
    if (sum_.empty()) sum_.assign(frame.ao.size(), 0.0);
    for (size_t i = 0; i < sum_.size(); ++i) sum_[i] += static_cast<double>(frame.ao[i]);
    ++frames_;
  }
  std::vector<float> result() const {
    std::vector<float> mean(sum_.size());
    std::transform(sum_.begin(), sum_.end(), mean.begin(),
                   [&](double sum) { return static_cast<float>(sum / static_cast<double>(frames_)); });
    return mean; // kInvalidAo survives averaging: the view is fixed, so a pixel misses in all frames or in none
  }

private:
  std::vector<double> sum_;
  uint32_t frames_ = 0;
};

uint64_t hit_pixels(const GBuffer& g) {
  return static_cast<uint64_t>(
      std::count_if(g.instance.begin(), g.instance.end(), [](uint32_t id) { return id != kNoInstance; }));
}

Vec3 shade(const Material& material, Vec3 albedo, float ao) {
  return (material.flags & kEmissive) != 0 ? Vec3(1.0f) : albedo * ao;
}

/// Box-filters the sub-pixels whose camera rays hit, and fills every layer except the LOD layers.
void resolve(const SceneSource& source, const GBuffer& g, const std::vector<float>& ao, const std::vector<float>& raw,
             uint32_t factor, RenderedImage& image) {
  const std::span<const Material> materials = source.materials();
  const size_t n = image.size.pixels();
  image.ao.assign(n, kInvalidAo), image.ao_raw.assign(n, kInvalidAo);
  image.depth.assign(n, 0.0f), image.coverage.assign(n, 0.0f);
  image.normal.assign(n, Vec3(0)), image.albedo.assign(n, Vec3(0)), image.shaded.assign(n, Vec3(0));
  image.instance.assign(n, kNoInstance);
  for (uint32_t y = 0; y < image.size.height; ++y) {
    for (uint32_t x = 0; x < image.size.width; ++x) {
      const size_t out = static_cast<size_t>(y) * image.size.width + x;
      uint32_t hits = 0;
      float ao_sum = 0, raw_sum = 0, depth_sum = 0;
      Vec3 normal(0), albedo(0), shaded(0);
      for (uint32_t sub = 0; sub < factor * factor; ++sub) {
        const size_t in = (static_cast<size_t>(y) * factor + sub / factor) * g.size.width +
                          static_cast<size_t>(x) * factor + sub % factor;
        if (g.instance[in] == kNoInstance) continue;
        if (hits++ == 0) image.instance[out] = g.instance[in];
        ao_sum += ao[in], raw_sum += raw[in], depth_sum += g.view_z[in];
        normal += g.normal[in], albedo += g.albedo[in];
        shaded += shade(materials[g.material[in]], g.albedo[in], ao[in]);
      }
      if (hits == 0) continue;
      const float scale = 1.0f / static_cast<float>(hits);
      image.ao[out] = ao_sum * scale, image.ao_raw[out] = raw_sum * scale, image.depth[out] = depth_sum * scale;
      image.coverage[out] = static_cast<float>(hits) / static_cast<float>(factor * factor);
      const float length = glm::length(normal);
      image.normal[out] = length > 0 ? normal / length : Vec3(0);
      image.albedo[out] = albedo * scale, image.shaded[out] = shaded * scale;
    }
  }
}

/// Fills the LOD layers: level, cluster and screen-space error per pixel.
void resolve_detail(const SceneSource& source, const PrimaryCamera& view, const GBuffer& g, uint32_t factor,
                    RenderedImage& image) {
  const size_t n = image.size.pixels();
  image.lod.assign(n, 0), image.cluster.assign(n, 0), image.lod_error.assign(n, 0.0f);
  for (uint32_t y = 0; y < g.size.height; ++y)
    for (uint32_t x = 0; x < g.size.width; ++x) {
      const size_t in = static_cast<size_t>(y) * g.size.width + x;
      if (g.instance[in] == kNoInstance) continue;
      const size_t out = static_cast<size_t>(y / factor) * image.size.width + x / factor;
      const SurfaceDetail detail = source.detail_of(g.instance[in], g.triangle[in]);
      const double error_px = error_in_pixels(view, DVec3(g.position[in]), static_cast<double>(detail.error_world));
      image.lod_error[out] = std::max(image.lod_error[out], static_cast<float>(error_px));
      image.lod[out] = detail.level, image.cluster[out] = detail.cluster;
    }
}

} // namespace

void validate(const RenderConfig& config) {
  require(config.size.width >= 1 && config.size.height >= 1, "image size must be at least 1x1");
  require(config.supersample >= 1 && config.supersample <= kMaxSupersample, "supersample must be in [1, 8]");
  require(config.frames >= 1 && config.frames <= kMaxFrames, "frames must be in [1, 65536]");
  const uint64_t width = uint64_t{config.size.width} * config.supersample;
  const uint64_t height = uint64_t{config.size.height} * config.supersample;
  require(width <= kMaxTracedSide && height <= kMaxTracedSide && width * height <= kMaxTracedPixels,
          "image size times supersample exceeds 65536 per side or 2^28 pixels");
}

RenderedImage render_view(const SceneSource& source, const RayTracer& tracer, const Camera& camera,
                          const RenderConfig& config, Progress& progress, const ChooseOccluders& choose_occluders) {
  validate(config);
  RenderedImage image;
  image.size = config.size;

  const PrimaryCamera view(camera, traced_size(config));
  GBuffer g;
  const Stopwatch primary;
  trace_primary(source, tracer, view, view, g, progress);
  image.timings.primary_s = primary.seconds();
  image.primary_rays = g.size.pixels();

  image.seen = hit_pixels(g) > 0;
  if (!image.seen && config.stop_if_nothing_visible) return image;

  Occluders occluders{&source, &tracer, 0.0};
  if (choose_occluders) {
    occluders = choose_occluders(g, view);
    const Stopwatch lifting;
    lift_origins(*occluders.tracer, view, occluders.error_px, g, progress);
    image.timings.ao_s += lifting.seconds();
  }
  const bool quarter = config.ao_resolution == AoResolution::kQuarter;
  const Stopwatch halving;
  const HalfGBuffer half = quarter ? halve(g) : HalfGBuffer{};
  image.timings.upsample_s = quarter ? halving.seconds() : 0.0;
  const GBuffer& shaded = quarter ? half.gbuffer : g;
  image.ao_rays = hit_pixels(shaded) * config.ao.spp * config.frames;
  AoFrame raw;
  AoDenoiser denoiser(config.denoiser);
  FrameMean mean;
  std::vector<float> ao;
  progress.begin("ambient occlusion", config.frames * static_cast<uint64_t>(shaded.size.pixels()));
  for (uint32_t frame = 0; frame < config.frames; ++frame) {
    const Stopwatch tracing;
    trace_ao(*occluders.source, *occluders.tracer, shaded, config.ao, frame, raw, progress);
    image.timings.ao_s += tracing.seconds();
    const Stopwatch denoising;
    if (!config.denoise)
      mean.add(raw);
    else if (const DenoisedAo& denoised = denoiser.next_frame(shaded, raw); frame + 1 == config.frames)
      ao = denoised.ao;
    image.timings.denoise_s += denoising.seconds();
  }
  if (!config.denoise) ao = mean.result();
  if (quarter) {
    const Stopwatch upsampling;
    const bool same = !config.denoise && config.frames == 1;
    ao = upsample_ao(g, half, ao);
    raw.ao = same ? ao : upsample_ao(g, half, raw.ao);
    image.timings.upsample_s += upsampling.seconds();
  }
  resolve(source, g, ao, raw.ao, config.supersample, image);
  if (config.lod_layers) resolve_detail(source, view, g, config.supersample, image);
  return image;
}

} // namespace packtrace
