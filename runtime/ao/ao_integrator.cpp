#include "runtime/ao/ao_integrator.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "runtime/ao/ray_sorter.h"
#include "runtime/ao/shading_points.h"
#include "runtime/ao/view_occlusion.h"
#include "runtime/ao/visibility_curve.h"
#include "runtime/camera/tiles.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxSamplesPerCall = 4; ///< maximum samples per pixel that one tracer call gets for a tile
constexpr ImageSize kSortedTile{64, 128};
constexpr float kMissed = std::numeric_limits<float>::infinity(); ///< distance of a miss

/// Memory for the rays of a tile, kept from tile to tile.
struct TileMemory {
  struct Chosen {
    uint32_t x, y, pixel, count;
  };
  std::vector<Chosen> chosen; ///< pixels that get samples
  ShadingPoints points;
  std::vector<uint32_t> next; ///< number of the next sample of each point
  std::vector<Ray> rays;
  std::vector<RayHit> hits, sorted_hits;
  std::vector<uint8_t> occluded, sorted_occluded;
  std::vector<float> distances, luminances; ///< of the samples of a pass
  std::vector<double> visibility, distance; ///< sums over the samples of each point
  RaySorter sorter;
};

/// Adds the samples of a pass to the sums of their points.
/// @param distances hit distances in radii, kMissed for a miss
PACKTRACE_AVX2_CLONES
void add_samples(size_t count, VisibilityCurve curve, const float* distances, const float* luminances,
                 double* visibility, double* distance) {
#pragma GCC ivdep
  for (size_t i = 0; i < count; ++i) {
    const float x = distances[i], k = curve.visibility(x, luminances[i]);
    visibility[i] += static_cast<double>(x < kMissed ? k : 1.0f);
    distance[i] += static_cast<double>(smaller(x, 1.0f));
  }
}

class AoTracer {
public:
  AoTracer(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer, const AoConfig& config,
           const SamplePlan& plan, AoFrame& out)
      : source_(source), tracer_(tracer), gbuffer_(gbuffer), config_(config), plan_(plan), curve_(config),
        sampler_(config.sampler, config.seed, config.sampler_block), radius_(ao_radius(config, source.world_bounds())),
        inverse_radius_(static_cast<float>(1.0 / (double{radius_} * tracer.space().scale()))),
        ray_length_(static_cast<float>(double{radius_} * tracer.space().scale() * double{curve_.end()})), out_(out) {}

  /// @tparam Result RayHit for nearest-hit queries, which return distances; uint8_t for any-hit queries
  /// @return the number of rays
  template <typename Result>
  uint64_t trace_tile(const Tile& tile, TileMemory& m, const Progress& progress) const {
    choose_pixels(tile, m);
    const auto count = static_cast<uint32_t>(m.chosen.size());
    if (count == 0) return 0;
    m.points.load(gbuffer_, sampler_, tracer_.space(), config_.offset_scale);
    m.visibility.assign(count, 0.0), m.distance.assign(count, 0.0);
    const uint32_t passes = m.chosen.front().count;
    const uint32_t together =
        std::clamp(tracer_.preferred_rays_per_call() / count, 1u, std::min(passes, kMaxSamplesPerCall));
    uint64_t rays = 0;
    for (uint32_t pass = 0; pass < passes; pass += together) {
      progress.check_cancelled(); // a tile of 65,536 samples takes minutes
      rays += trace_passes<Result>(pass, std::min(pass + together, passes), m);
    }
    for (uint32_t i = 0; i < count; ++i) {
      const TileMemory::Chosen& c = m.chosen[i];
      const double per_sample = 1.0 / c.count;
      out_.ao[c.pixel] = static_cast<float>(m.visibility[i] * per_sample);
      if (out_.with_distances)
        out_.hit_distance[c.pixel] = static_cast<float>(m.distance[i] * per_sample * double{radius_});
    }
    return rays;
  }

private:
  /// Selects the pixels of a tile that get samples, in Morton order, so that consecutive rays share cache lines of the
  /// BVH, those with more samples first. Writes kInvalidAo to the others.
  void choose_pixels(const Tile& tile, TileMemory& m) const {
    m.chosen.clear(), m.points.clear(), m.next.clear();
    for (uint32_t y0 = tile.y0; y0 < tile.y1; y0 += kTileSize)
      for (uint32_t x0 = tile.x0; x0 < tile.x1; x0 += kTileSize)
        for (uint32_t code = 0; code < kTileSize * kTileSize; ++code) {
          const uint32_t x = x0 + morton_even_bits(code), y = y0 + morton_even_bits(code >> 1);
          if (x >= tile.x1 || y >= tile.y1) continue;
          const uint32_t pixel = y * gbuffer_.size.width + x, count = samples_of(x, y, pixel);
          if (count > 0) {
            m.chosen.push_back({x, y, pixel, count});
          } else {
            out_.ao[pixel] = kInvalidAo;
            if (out_.with_distances) out_.hit_distance[pixel] = 0.0f;
          }
        }
    if (!plan_.pixel_count.empty()) std::ranges::stable_sort(m.chosen, std::greater(), &TileMemory::Chosen::count);
    for (const TileMemory::Chosen& c : m.chosen) {
      m.points.add(c.x, c.y, c.pixel);
      m.next.push_back(plan_.pixel_first.empty() ? plan_.first : plan_.pixel_first[c.pixel]);
    }
  }

  uint32_t samples_of(uint32_t x, uint32_t y, uint32_t pixel) const {
    if (gbuffer_.instance[pixel] == kNoInstance || (plan_.colour && ((x + y) & 1u) != *plan_.colour)) return 0;
    return plan_.pixel_count.empty() ? plan_.count : plan_.pixel_count[pixel];
  }

  /// Number of points that have more than `pass` samples.
  static uint32_t active(uint32_t pass, const TileMemory& m) {
    if (m.chosen.back().count > pass) return static_cast<uint32_t>(m.chosen.size());
    const auto end = std::ranges::partition_point(m.chosen, [&](const auto& c) { return c.count > pass; });
    return static_cast<uint32_t>(end - m.chosen.begin());
  }

  /// Traces some samples of each point together. Returns the number of rays.
  template <typename Result>
  uint64_t trace_passes(uint32_t begin, uint32_t end, TileMemory& m) const {
    m.rays.clear();
    for (uint32_t pass = begin; pass < end; ++pass) {
      const uint32_t n = active(pass, m);
      m.rays.resize(m.rays.size() + n);
      m.points.write_rays(sampler_, m.next, ray_length_, std::span(m.rays).last(n));
      for (uint32_t i = 0; i < n; ++i) ++m.next[i];
    }
    std::span<const Result> results = traced<Result>(m);
    for (uint32_t pass = begin; pass < end; ++pass) {
      const uint32_t n = active(pass, m);
      accumulate(results.first(n), m);
      results = results.subspan(n);
    }
    return m.rays.size();
  }

  template <typename Result>
  std::span<const Result> traced(TileMemory& m) const {
    auto& results = results_of(m, Result{});
    results.resize(m.rays.size());
    if (!config_.sort_rays) {
      query(m.rays, results);
      return results;
    }
    auto& sorted = sorted_of(m, Result{});
    sorted.resize(m.rays.size());
    query(m.sorter.sort(m.rays), sorted);
    for (size_t i = 0; i < sorted.size(); ++i) results[m.sorter.order()[i]] = sorted[i];
    return results;
  }

  static std::vector<RayHit>& results_of(TileMemory& m, RayHit) { return m.hits; }
  static std::vector<uint8_t>& results_of(TileMemory& m, uint8_t) { return m.occluded; }
  static std::vector<RayHit>& sorted_of(TileMemory& m, RayHit) { return m.sorted_hits; }
  static std::vector<uint8_t>& sorted_of(TileMemory& m, uint8_t) { return m.sorted_occluded; }

  void query(std::span<const Ray> rays, std::span<RayHit> hits) const {
    tracer_.closest_hits(rays, kOcclusionRays, RayOrder::kIncoherent, hits);
  }
  void query(std::span<const Ray> rays, std::span<uint8_t> occluded) const {
    tracer_.any_hits(rays, kOcclusionRays, RayOrder::kIncoherent, occluded);
  }

  void accumulate(std::span<const uint8_t> occluded, TileMemory& m) const {
    const double dark = double{curve_.visibility(0.0f, 0.0f)};
    for (size_t i = 0; i < occluded.size(); ++i) {
      m.visibility[i] += occluded[i] != 0 ? dark : 1.0;
      m.distance[i] += occluded[i] != 0 ? 0.5 : 1.0;
    }
  }

  void accumulate(std::span<const RayHit> hits, TileMemory& m) const {
    m.distances.resize(hits.size()), m.luminances.resize(hits.size(), 0.0f);
    for (size_t i = 0; i < hits.size(); ++i) m.distances[i] = hits[i].valid() ? hits[i].t * inverse_radius_ : kMissed;
    if (config_.interreflection > 0.0f)
      for (size_t i = 0; i < hits.size(); ++i) m.luminances[i] = hits[i].valid() ? luminance(hits[i]) : 0.0f;
    add_samples(hits.size(), curve_, m.distances.data(), m.luminances.data(), m.visibility.data(), m.distance.data());
  }

  /// Luminance of the hit surface's albedo, with Rec. 709 weights.
  float luminance(const RayHit& hit) const {
    const HitSurface surface = tracer_.resolve(hit);
    const uint32_t material = source_.material_of(surface.placement->instance, surface.triangle);
    const Vec3 albedo = source_.materials()[material].albedo;
    return std::clamp(0.2126f * albedo.x + 0.7152f * albedo.y + 0.0722f * albedo.z, 0.0f, 1.0f);
  }

  const SceneSource& source_;
  const RayTracer& tracer_;
  const GBuffer& gbuffer_;
  const AoConfig& config_;
  const SamplePlan& plan_;
  const VisibilityCurve curve_;
  const PixelSampler sampler_;
  const float radius_;         ///< world units
  const float inverse_radius_; ///< radii per length of the tracer's space
  const float ray_length_;
  AoFrame& out_;
};

/// The least number of samples of the pixels that get any.
uint32_t least_samples(const SamplePlan& plan) {
  if (plan.pixel_count.empty()) return plan.count;
  uint32_t least = UINT16_MAX;
  for (const uint16_t count : plan.pixel_count)
    if (count > 0) least = std::min<uint32_t>(least, count);
  return least;
}

} // namespace

uint64_t trace_ao(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer, const AoConfig& config,
                  const SamplePlan& plan, AoFrame& ao, Progress& progress) {
  validate(config);
  const size_t pixels = gbuffer.size.pixels();
  if (ao.size != gbuffer.size || ao.ao.size() != pixels || ao.hit_distance.size() != (ao.with_distances ? pixels : 0))
    ao.resize(gbuffer.size);
  ao.max_history.clear();
  ao.ray_length = config.radius;
  ao.stratified = is_stratified(config.sampler);
  ao.samples = least_samples(plan);
  if (const auto* view = dynamic_cast<const ViewTracer*>(&tracer); view && traces_view_occlusion(config, plan))
    return trace_view_occlusion(*view, tracer.space(), gbuffer, config, ao_radius(config, source.world_bounds()), plan,
                                ao, progress);
  ao.on_gpu = nullptr;
  const AoTracer ao_tracer(source, tracer, gbuffer, config, plan, ao);
  const bool closest = config.falloff || config.interreflection > 0.0f;
  tbb::enumerable_thread_specific<TileMemory> memory;
  std::atomic<uint64_t> rays = 0;
  const ImageSize tile_size = config.sort_rays ? kSortedTile : ImageSize{kTileSize, kTileSize};
  for_each_tile(gbuffer.size, tile_size, progress, [&](const Tile& tile) {
    rays += closest ? ao_tracer.trace_tile<RayHit>(tile, memory.local(), progress)
                    : ao_tracer.trace_tile<uint8_t>(tile, memory.local(), progress);
  });
  return rays;
}

} // namespace packtrace
