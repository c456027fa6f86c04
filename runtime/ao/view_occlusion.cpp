#include "runtime/ao/view_occlusion.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "runtime/ao/hash.h"
#include "runtime/ao/shading_points.h"
#include "runtime/ao/visibility_curve.h"
#include "runtime/camera/tiles.h"

namespace packtrace {
namespace {

/// The points of a picture's tiles, one vector per tile in rows.
class TilePoints {
public:
  TilePoints(const GBuffer& gbuffer, const SamplePlan& plan)
      : gbuffer_(gbuffer), plan_(plan), columns_((gbuffer.size.width + kTileSize - 1) / kTileSize),
        tiles_(size_t{columns_} * ((gbuffer.size.height + kTileSize - 1) / kTileSize)) {}

  /// Fills a tile, in Morton order; resets the pixels that get no samples.
  void fill(const Tile& tile, const PixelSampler& sampler, const UnitSpace& space, float offset_scale,
            ShadingPoints& points, AoFrame& ao) {
    points.clear();
    for (uint32_t code = 0; code < kTileSize * kTileSize; ++code) {
      const uint32_t x = tile.x0 + morton_even_bits(code), y = tile.y0 + morton_even_bits(code >> 1);
      if (x >= tile.x1 || y >= tile.y1) continue;
      const uint32_t pixel = y * gbuffer_.size.width + x;
      if (gbuffer_.instance[pixel] != kNoInstance && (!plan_.colour || ((x + y) & 1u) == *plan_.colour)) {
        points.add(x, y, pixel);
      } else {
        ao.ao[pixel] = kInvalidAo;
        ao.hit_distance[pixel] = 0.0f;
      }
    }
    points.load(gbuffer_, sampler, space, offset_scale);
    std::vector<OcclusionPoint>& out = tiles_[size_t{tile.y0 / kTileSize} * columns_ + tile.x0 / kTileSize];
    out.resize(points.count());
    points.copy_to(out);
  }

  std::vector<OcclusionPoint> all() const {
    std::vector<OcclusionPoint> points;
    for (const std::vector<OcclusionPoint>& tile : tiles_) points.insert(points.end(), tile.begin(), tile.end());
    return points;
  }

private:
  const GBuffer& gbuffer_;
  const SamplePlan& plan_;
  const uint32_t columns_;
  std::vector<std::vector<OcclusionPoint>> tiles_;
};

OcclusionSamples samples_of(const AoConfig& config, const SamplePlan& plan, float radius, const UnitSpace& space) {
  const VisibilityCurve curve(config);
  const double length = double{radius} * space.scale();
  OcclusionSamples out;
  out.first = plan.first, out.count = plan.count;
  out.seed = hash_combine(static_cast<uint32_t>(config.seed), static_cast<uint32_t>(config.seed >> 32));
  out.tfar = static_cast<float>(length * double{curve.end()});
  out.nearest = config.falloff;
  out.inverse_radius = static_cast<float>(1.0 / length);
  out.lambda = curve.lambda(), out.darkening = curve.darkening(), out.end = curve.end();
  out.floor = curve.floor(), out.scale = curve.scale(), out.parabola = curve.parabola();
  return out;
}

} // namespace

bool traces_view_occlusion(const ViewTracer& tracer, const AoConfig& config, const SamplePlan& plan) {
  return config.sampler == SamplerKind::kSpaceTimeNet && config.interreflection == 0.0f && plan.pixel_count.empty() &&
         plan.pixel_first.empty() && (config.falloff || config.min_visibility == 0.0f) &&
         tracer.traces_occlusion(config.falloff);
}

uint64_t trace_view_occlusion(const ViewTracer& tracer, const UnitSpace& space, const GBuffer& gbuffer,
                              const AoConfig& config, float radius, const SamplePlan& plan, AoFrame& ao,
                              Progress& progress) {
  const PixelSampler sampler(config.sampler, config.seed, config.sampler_block);
  TilePoints tiles(gbuffer, plan);
  tbb::enumerable_thread_specific<ShadingPoints> memory;
  Progress quiet; // the points are made within a fraction of the time
  for_each_tile(gbuffer.size, quiet,
                [&](const Tile& tile) { tiles.fill(tile, sampler, space, config.offset_scale, memory.local(), ao); });
  const std::vector<OcclusionPoint> points = tiles.all();
  progress.advance(gbuffer.size.pixels() - points.size());
  const OcclusionSamples samples = samples_of(config, plan, radius, space);
  if (ao.may_stay_on_gpu) {
    ao.on_gpu = tracer.leave_occlusion(points, samples, {gbuffer.size.pixels(), double{radius}}, std::move(ao.on_gpu),
                                       progress);
    return points.size() * uint64_t{plan.count};
  }
  ao.on_gpu = nullptr;
  std::vector<OcclusionSums> sums(points.size());
  tracer.trace_occlusion(points, samples, sums, progress);
  const double per_sample = 1.0 / plan.count;
  for (size_t i = 0; i < points.size(); ++i) {
    ao.ao[points[i].pixel] = static_cast<float>(sums[i].visibility * per_sample);
    ao.hit_distance[points[i].pixel] = static_cast<float>(sums[i].distance * per_sample * double{radius});
  }
  return points.size() * uint64_t{plan.count};
}

} // namespace packtrace
