#include "runtime/ao/view_occlusion.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_arena.h>

#include "runtime/ao/hash.h"
#include "runtime/ao/shading_points.h"
#include "runtime/ao/visibility_curve.h"
#include "runtime/camera/device_surfaces.h"
#include "runtime/camera/tiles.h"

namespace packtrace {
namespace {

/// The points of a picture: tile by tile in rows, and in Morton order within tiles.
class TilePoints {
public:
  TilePoints(const GBuffer& gbuffer, const SamplePlan& plan, const UnitSpace& space, float offset_scale)
      : gbuffer_(gbuffer), plan_(plan), space_(space), offset_scale_(offset_scale),
        columns_((gbuffer.size.width + kTileSize - 1) / kTileSize),
        first_(size_t{columns_} * ((gbuffer.size.height + kTileSize - 1) / kTileSize) + 1) {
    for_each_tile(gbuffer_.size, quiet_, [&](const Tile& tile) { first_[number_of(tile) + 1] = count_in(tile); });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
  }

  size_t count() const { return first_.back(); }
  bool has_point(uint32_t x, uint32_t y) const {
    return gbuffer_.instance[size_t{y} * gbuffer_.size.width + x] != kNoInstance &&
           (!plan_.colour || ((x + y) & 1u) == *plan_.colour);
  }

  /// Writes points [first, first + out.size()).
  /// @param tracer has the points if the G-buffer has not
  void write(const ViewTracer& tracer, size_t first, std::span<OcclusionPoint> out) {
    if (gbuffer_.points_on_gpu && surfaces_ == &gbuffer_) {
      read_device_points(tracer, gbuffer_, read_);
      surfaces_ = &read_;
    }
    // Callers may hold locks, so the thread must not take up other work while it waits.
    tbb::this_task_arena::isolate([&] {
      for_each_tile(gbuffer_.size, quiet_, [&](const Tile& tile) {
        const size_t number = number_of(tile), tile_first = first_[number];
        const size_t begin = std::max(first, tile_first), end = std::min(first + out.size(), first_[number + 1]);
        if (begin >= end) return;
        ShadingPoints& points = memory_.local();
        load(tile, points);
        points.copy_to(begin - tile_first, out.subspan(begin - first, end - begin));
      });
    });
  }

private:
  size_t number_of(const Tile& tile) const { return size_t{tile.y0 / kTileSize} * columns_ + tile.x0 / kTileSize; }

  size_t count_in(const Tile& tile) const {
    size_t count = 0;
    for (uint32_t y = tile.y0; y < tile.y1; ++y)
      for (uint32_t x = tile.x0; x < tile.x1; ++x) count += has_point(x, y) ? 1 : 0;
    return count;
  }

  void load(const Tile& tile, ShadingPoints& points) const {
    points.clear();
    for (uint32_t code = 0; code < kTileSize * kTileSize; ++code) {
      const uint32_t x = tile.x0 + morton_even_bits(code), y = tile.y0 + morton_even_bits(code >> 1);
      if (x < tile.x1 && y < tile.y1 && has_point(x, y)) points.add(x, y, y * gbuffer_.size.width + x);
    }
    points.load_surfaces(*surfaces_, space_, offset_scale_);
  }

  const GBuffer& gbuffer_;
  GBuffer read_; ///< points of a device
  const GBuffer* surfaces_ = &gbuffer_;
  const SamplePlan& plan_;
  const UnitSpace& space_;
  const float offset_scale_;
  const uint32_t columns_;
  std::vector<size_t> first_; ///< number of the first point, by tile; then of all
  tbb::enumerable_thread_specific<ShadingPoints> memory_;
  Progress quiet_; ///< points are made within a fraction of the time
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

bool traces_view_occlusion(const AoConfig& config, const SamplePlan& plan) {
  return config.sampler == SamplerKind::kSpaceTimeNet && config.interreflection == 0.0f && plan.pixel_count.empty() &&
         plan.pixel_first.empty() && (config.falloff || config.min_visibility == 0.0f);
}

uint64_t trace_view_occlusion(const ViewTracer& tracer, const UnitSpace& space, const GBuffer& gbuffer,
                              const AoConfig& config, float radius, const SamplePlan& plan, AoFrame& ao,
                              Progress& progress) {
  TilePoints tiles(gbuffer, plan, space, config.offset_scale);
  const size_t count = tiles.count();
  progress.advance(gbuffer.size.pixels() - count);
  const OcclusionSamples samples = samples_of(config, plan, radius, space);
  if (ao.may_stay_on_gpu) {
    OcclusionPoints points{count,
                           [&](size_t first, std::span<OcclusionPoint> out) { tiles.write(tracer, first, out); }};
    if (gbuffer.on_gpu)
      points.surfaces = DeviceSurfaces{gbuffer.on_gpu.get(), gbuffer.size, plan.colour, config.offset_scale};
    ao.on_gpu = tracer.leave_occlusion(points, samples, {gbuffer.size.pixels(), double{radius}}, std::move(ao.on_gpu),
                                       progress);
    return count * uint64_t{plan.count};
  }
  ao.on_gpu = nullptr;
  std::vector<OcclusionPoint> points(count);
  tiles.write(tracer, 0, points);
  std::vector<OcclusionSums> sums(count);
  const auto copy = [&](size_t first, std::span<OcclusionPoint> out) {
    std::copy_n(points.begin() + static_cast<std::ptrdiff_t>(first), out.size(), out.begin());
  };
  tracer.trace_occlusion({count, copy}, samples, sums, progress);
  std::ranges::fill(ao.ao, kInvalidAo);
  std::ranges::fill(ao.hit_distance, 0.0f);
  const double per_sample = 1.0 / plan.count;
  for (size_t i = 0; i < count; ++i) {
    ao.ao[points[i].pixel] = static_cast<float>(sums[i].visibility * per_sample);
    ao.hit_distance[points[i].pixel] = static_cast<float>(sums[i].distance * per_sample * double{radius});
  }
  return count * uint64_t{plan.count};
}

} // namespace packtrace
