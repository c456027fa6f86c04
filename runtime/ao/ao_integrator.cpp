#include "runtime/ao/ao_integrator.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "pbrt_import/base/error.h"
#include "runtime/camera/tiles.h"

namespace packtrace {
namespace {

constexpr uint32_t kTilePixels = kTileSize * kTileSize;
constexpr uint32_t kMaxSamplesPerCall = 4; ///< maximum samples per pixel that one tracer call gets for a tile

/// Visibility of a sample as a function of its hit distance; see AoConfig.
class Coefficient {
public:
  explicit Coefficient(const AoConfig& config)
      : lambda_(config.falloff ? config.lambda : 0.0), darkening_(1.0 - config.min_visibility),
        rho_(config.interreflection) {
    if (!config.falloff) return;
    if (config.lambda > 0.0f && config.cutoff > 0.0f)
      end_ = std::min(1.0, std::sqrt(-std::log(double(config.cutoff)) / config.lambda));
    floor_ = config.continuous ? std::exp(-lambda_ * end_ * end_) : 0.0;
    linear_ = config.continuous && 1.0 - floor_ < 1e-6; // the limit for lambda -> 0
  }

  /// Length of the rays (x_end), in radii.
  double end() const { return end_; }

  /// @param x hit distance in radii, [0, end]
  /// @param luminance luminance of the hit surface's albedo; used only if rho > 0
  double visibility(double x, double luminance) const {
    x = std::min(x, end_);
    const double occlusion = linear_         ? 1.0 - (x / end_) * (x / end_)
                             : lambda_ > 0.0 ? (std::exp(-lambda_ * x * x) - floor_) / (1.0 - floor_)
                                             : 1.0;
    const double k = 1.0 - darkening_ * std::clamp(occlusion, 0.0, 1.0);
    return rho_ > 0.0 && k > 0.0 ? k / (1.0 - rho_ * luminance * (1.0 - k)) : k;
  }

private:
  double lambda_, darkening_, rho_;
  double end_ = 1.0;
  double floor_ = 0.0;
  bool linear_ = false;
};

/// Completes the unit vector n to an orthonormal basis. Source: Duff et al., "Building an orthonormal basis, revisited"
/// (2017). The paper switches formulas at z = 0; this version switches at z = -0.4. Vertical walls have z = +0, -0 or a
/// rounding error, so a switch at 0 would rotate their sample pattern from pixel to pixel.
void make_basis(Vec3 n, Vec3& tangent, Vec3& bitangent) {
  constexpr float kSwitch = -0.4f; // keeps |sign + z| >= 0.6
  const float sign = n.z < kSwitch ? -1.0f : 1.0f;
  const float a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  tangent = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
  bitangent = {b, sign + n.y * n.y * a, -n.y};
}

/// A pixel whose camera ray hit a surface, prepared for casting occlusion rays.
struct ShadingPoint {
  size_t pixel;
  PixelSampler::Pixel sampler;
  Vec3 geometric;
  Vec3 normal, tangent, bitangent;
};

class AoTracer {
public:
  AoTracer(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer, const AoConfig& config,
           uint32_t frame_index, AoFrame& out)
      : source_(source), tracer_(tracer), gbuffer_(gbuffer), config_(config), coefficient_(config),
        sampler_(config.sampler, config.seed), first_sample_(static_cast<uint64_t>(frame_index) * config.spp),
        unit_radius_(config.radius * tracer.space().scale()),
        ray_length_(static_cast<float>(unit_radius_ * coefficient_.end())), out_(out) {}

  /// @tparam Result RayHit for nearest-hit queries, which return distances; uint8_t for any-hit queries
  template <typename Result>
  void trace_tile(const Tile& tile, const Progress& progress) const {
    const uint32_t together =
        std::clamp(tracer_.preferred_rays_per_call() / kTilePixels, 1u, std::min(config_.spp, kMaxSamplesPerCall));
    if (together == 1)
      trace_samples<Result, 1>(tile, together, progress);
    else
      trace_samples<Result, kMaxSamplesPerCall>(tile, together, progress);
  }

private:
  /// @param together samples per pixel in one tracer call, at most kRoom
  template <typename Result, uint32_t kRoom>
  void trace_samples(const Tile& tile, uint32_t together, const Progress& progress) const {
    ShadingPoint points[kTilePixels];
    alignas(64) Ray rays[kRoom * kTilePixels];
    const uint32_t count = gather(tile, points, rays);
    if (count == 0) return;
    for (uint32_t s = 1; s < together; ++s) std::copy_n(rays, count, rays + s * count);
    Result results[kRoom * kTilePixels];
    double visibility[kTilePixels] = {}, distance[kTilePixels] = {};
    for (uint32_t first = 0; first < config_.spp; first += together) {
      progress.check_cancelled(); // a tile of 65,536 samples takes minutes
      const uint32_t samples = std::min(together, config_.spp - first);
      for (uint32_t s = 0; s < samples; ++s) {
        const PixelSampler::Number number = sampler_.number(first_sample_ + first + s);
        for (uint32_t i = 0; i < count; ++i) rays[s * count + i].direction = direction(points[i], number);
      }
      query(std::span(rays, samples * count), std::span(results, samples * count));
      for (uint32_t s = 0; s < samples; ++s)
        for (uint32_t i = 0; i < count; ++i) accumulate(results[s * count + i], visibility[i], distance[i]);
    }
    const double per_sample = 1.0 / config_.spp;
    for (uint32_t i = 0; i < count; ++i) {
      out_.ao[points[i].pixel] = static_cast<float>(visibility[i] * per_sample);
      out_.hit_distance[points[i].pixel] = static_cast<float>(distance[i] * per_sample * config_.radius);
    }
  }

  /// Collects the tile's hit pixels in Morton order, so that consecutive rays share cache lines of the BVH, and writes
  /// kInvalidAo to the others. Returns the number of hit pixels.
  uint32_t gather(const Tile& tile, ShadingPoint* points, Ray* rays) const {
    uint32_t count = 0;
    for (uint32_t code = 0; code < kTilePixels; ++code) {
      const uint32_t x = tile.x0 + morton_even_bits(code), y = tile.y0 + morton_even_bits(code >> 1);
      if (x >= tile.x1 || y >= tile.y1) continue;
      const size_t pixel = static_cast<size_t>(y) * gbuffer_.size.width + x;
      if (gbuffer_.instance[pixel] == kNoInstance) {
        out_.ao[pixel] = kInvalidAo;
        out_.hit_distance[pixel] = 0.0f;
        continue;
      }
      ShadingPoint& point = points[count];
      point.pixel = pixel;
      point.sampler = sampler_.pixel(x, y);
      point.geometric = gbuffer_.geometric_normal[pixel];
      point.normal = gbuffer_.normal[pixel];
      make_basis(point.normal, point.tangent, point.bitangent);
      const DVec3 origin = DVec3(gbuffer_.position[pixel]) + DVec3(point.geometric) * double(gbuffer_.offset[pixel]);
      rays[count].origin = Vec3(tracer_.space().to_unit(origin));
      rays[count++].tfar = ray_length_;
    }
    return count;
  }

  Vec3 direction(const ShadingPoint& point, const PixelSampler::Number& number) const {
    const Vec3 local = cosine_direction(PixelSampler::point(point.sampler, number));
    const Vec3 direction = point.tangent * local.x + point.bitangent * local.y + point.normal * local.z;
    const float height = glm::dot(direction, point.geometric);
    return height < 0.0f ? direction - 2.0f * height * point.geometric : direction;
  }

  void query(std::span<const Ray> rays, std::span<RayHit> hits) const {
    tracer_.closest_hits(rays, kOcclusionRays, RayOrder::kIncoherent, hits);
  }
  void query(std::span<const Ray> rays, std::span<uint8_t> occluded) const {
    tracer_.any_hits(rays, kOcclusionRays, RayOrder::kIncoherent, occluded);
  }

  void accumulate(uint8_t occluded, double& visibility, double& distance) const {
    visibility += occluded ? coefficient_.visibility(0.0, 0.0) : 1.0;
    distance += occluded ? 0.5 : 1.0;
  }

  void accumulate(const RayHit& hit, double& visibility, double& distance) const {
    if (!hit.valid()) {
      visibility += 1.0;
      distance += 1.0;
      return;
    }
    const double x = hit.t / unit_radius_;
    visibility += coefficient_.visibility(x, config_.interreflection > 0.0f ? luminance(hit) : 0.0);
    distance += std::min(x, 1.0);
  }

  /// Luminance of the hit surface's albedo, with Rec. 709 weights.
  double luminance(const RayHit& hit) const {
    const HitSurface surface = tracer_.resolve(hit);
    const uint32_t material = source_.material_of(surface.placement->instance, surface.triangle);
    const Vec3 albedo = source_.materials()[material].albedo;
    return std::clamp(0.2126 * albedo.x + 0.7152 * albedo.y + 0.0722 * albedo.z, 0.0, 1.0);
  }

  const SceneSource& source_;
  const RayTracer& tracer_;
  const GBuffer& gbuffer_;
  const AoConfig& config_;
  const Coefficient coefficient_;
  const PixelSampler sampler_;
  const uint64_t first_sample_;
  const double unit_radius_;
  const float ray_length_;
  AoFrame& out_;
};

void require(bool condition, const char* message) {
  if (!condition) throw Error(ErrorKind::kUsage, std::string("ambient occlusion: ") + message);
}

} // namespace

float default_ao_radius(const Bounds& bounds) {
  const double radius = 0.1 * bounds.diagonal();
  return radius > 0.0 && std::isfinite(radius) ? static_cast<float>(radius) : 1.0f;
}

void validate(const AoConfig& config) {
  const auto within = [](float value, float lo, float hi) { return value >= lo && value <= hi; }; // false for NaN
  require(config.radius > 0.0f && std::isfinite(config.radius), "the radius must be positive and finite");
  require(config.spp >= 1 && config.spp <= 65536, "samples per pixel must be 1 to 65536");
  require(within(config.lambda, 0.0f, 20.0f), "lambda must be 0 to 20");
  require(config.cutoff >= 0.0f && config.cutoff < 1.0f, "the cutoff must be at least 0 and less than 1");
  require(within(config.min_visibility, 0.0f, 1.0f), "the minimum visibility must be 0 to 1");
  require(within(config.interreflection, 0.0f, 1.0f), "interreflection must be 0 to 1");
}

void trace_ao(const SceneSource& source, const RayTracer& tracer, const GBuffer& gbuffer, const AoConfig& config,
              uint32_t frame_index, AoFrame& ao, Progress& progress) {
  validate(config);
  if (ao.size != gbuffer.size || ao.ao.size() != gbuffer.size.pixels()) ao.resize(gbuffer.size);
  ao.ray_length = config.radius;
  const AoTracer ao_tracer(source, tracer, gbuffer, config, frame_index, ao);
  const bool closest = config.falloff || config.interreflection > 0.0f;
  for_each_tile(gbuffer.size, progress, [&](const Tile& tile) {
    closest ? ao_tracer.trace_tile<RayHit>(tile, progress) : ao_tracer.trace_tile<uint8_t>(tile, progress);
  });
}

} // namespace packtrace
