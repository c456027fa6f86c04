#include "runtime/shade/path_tracer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <tbb/enumerable_thread_specific.h>

#include "runtime/ao/hash.h"
#include "runtime/ao/hemisphere.h"
#include "runtime/ao/sampler.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/camera/tiles.h"
#include "runtime/shade/hit_surfaces.h"
#include "runtime/shade/shadow_rays.h"

namespace packtrace {
namespace {

constexpr float kFaint = 1e-4f;       ///< paths that carry less of each colour end
constexpr uint32_t kMaxVertices = 26; ///< surfaces of a path: 8 reflections, 16 transmissions

/// A surface that a path has reached, with what the path carries from it to the camera.
struct PathVertex {
  HitPoint point;
  Vec3 direction{0.0f};  ///< of the ray that reached it, unit length
  float distance = 0.0f; ///< that it came, world units
  float width = 0.0f;    ///< of the ray's cone at the point, world units
  Vec3 throughput{1.0f};
  uint32_t pixel = 0; ///< in the tile's list
  uint32_t reflections = 0, transmissions = 0;
  // Of the surface before, if it scattered the ray by its roughness, for multiple importance sampling:
  float density = 0.0f; ///< over solid angle; 0: it could only go this way
  Vec3 normal_before{0.0f};
  float light_samples_before = 1.0f;
};

/// The frame of a shading normal.
struct Frame {
  Vec3 tangent, bitangent, normal;
  explicit Frame(Vec3 n) : tangent(turned_to(n, {1, 0, 0})), bitangent(turned_to(n, {0, 1, 0})), normal(n) {}
  Vec3 local(Vec3 v) const { return {glm::dot(v, tangent), glm::dot(v, bitangent), glm::dot(v, normal)}; }
  Vec3 world(Vec3 v) const { return v.x * tangent + v.y * bitangent + v.z * normal; }
};

/// Sample points of a path's vertices: scrambled Sobol sequences, a sequence per vertex and purpose. Each has an order
/// of its own, since sequences that differ in their scrambling alone are correlated. Source: Burley, Practical
/// Hash-based Owen Scrambling, JCGT 2020.
class PathSamplers {
public:
  enum Purpose : uint32_t { kLightPoint, kLightChoice, kLobe, kAmbient, kPurposes };

  explicit PathSamplers(uint64_t seed) {
    for (uint32_t i = 0; i < kMaxVertices * kPurposes; ++i) {
      orders_.push_back(hash_combine(static_cast<uint32_t>(seed), i));
      samplers_.emplace_back(SamplerKind::kPixelSobol, seed + orders_.back());
    }
  }
  Vec2 point(uint32_t vertex, Purpose purpose, uint32_t x, uint32_t y, uint32_t sample) const {
    const uint32_t sequence = vertex * kPurposes + purpose;
    const uint32_t order = hash_combine(hash_combine(orders_[sequence], x), y);
    const PixelSampler& sampler = samplers_[sequence];
    return sampler.point(sampler.pixel(x, y), shuffled(sample, order));
  }

private:
  /// Shuffles numbers so that those of each aligned block of 2^k stay together in one, within the sequences' length.
  static uint32_t shuffled(uint32_t number, uint32_t seed) {
    constexpr uint32_t kLength = 1u << 16;
    return (number & ~(kLength - 1)) |
           (reverse_bits(scramble(reverse_bits(number & (kLength - 1)), seed)) & (kLength - 1));
  }

  std::vector<uint32_t> orders_;
  std::vector<PixelSampler> samplers_;
};

/// Memory for the paths of a tile, kept from tile to tile.
struct PathMemory {
  struct Pixel {
    uint32_t x, y;
    size_t index;
    Vec3 direct, specular, ambient;
  };
  std::vector<Pixel> pixels;
  std::vector<PathVertex> vertices, next;
  std::vector<Ray> rays, hit_rays;
  std::vector<RayHit> hits, valid_hits;
  std::vector<float> widths;
  std::vector<HitPoint> points;
  ShadowRays shadows;
};

float power_weight(float a, float b) {
  const float a2 = a * a, b2 = b * b;
  return a2 + b2 > 0.0f ? a2 / (a2 + b2) : 0.0f;
}

bool is_faint(Vec3 throughput) { return std::max({throughput.x, throughput.y, throughput.z}) < kFaint; }

class PathTracer {
public:
  PathTracer(const SceneSource& source, const RayTracer& tracer, const ShadeScene& scene, const PrimaryCamera& camera,
             const GBuffer& gbuffer, const ShadeConfig& config, const ShadeSamples& samples, ShadedFrame& frame)
      : tracer_(tracer), scene_(scene), lights_(scene.lights()), camera_(camera), gbuffer_(gbuffer), config_(config),
        samples_(samples), surfaces_(source, tracer, scene.textures()), samplers_(samples.seed),
        spread_((pixel_width(camera, 2.0f) - pixel_width(camera, 1.0f)) * samples.width_px), frame_(frame) {}

  uint64_t trace_tile(const Tile& tile, PathMemory& m, const Progress& progress) const {
    m.pixels.clear();
    for (uint32_t y = tile.y0; y < tile.y1; ++y)
      for (uint32_t x = tile.x0; x < tile.x1; ++x)
        m.pixels.push_back({x, y, size_t{y} * gbuffer_.size.width + x, Vec3(0), Vec3(0), Vec3(0)});
    uint64_t rays = 0;
    for (uint32_t s = 0; s < config_.samples; ++s) {
      progress.check_cancelled();
      rays += trace_sample(static_cast<uint32_t>(samples_.frame * config_.samples + s), m);
    }
    const float scale = 1.0f / static_cast<float>(config_.samples);
    for (const PathMemory::Pixel& pixel : m.pixels) {
      frame_.direct[pixel.index] = pixel.direct * scale;
      frame_.specular[pixel.index] = pixel.specular * scale;
      frame_.ambient[pixel.index] = pixel.ambient * scale;
    }
    return rays;
  }

private:
  /// Traces a path of each pixel.
  uint64_t trace_sample(uint32_t sample, PathMemory& m) const {
    begin_paths(m);
    uint64_t rays = 0;
    for (uint32_t number = 0; !m.vertices.empty() && number < kMaxVertices; ++number) {
      m.shadows.clear(), m.rays.clear(), m.next.clear();
      for (const PathVertex& vertex : m.vertices) shade({vertex, number, sample}, m);
      rays += m.shadows.size() + m.rays.size();
      m.shadows.trace(tracer_, surfaces_, scene_.glass(), config_.shadow_depth, [&](uint32_t pixel, Vec3 radiance) {
        (number == 0 ? m.pixels[pixel].direct : m.pixels[pixel].specular) += radiance;
      });
      follow(m);
    }
    return rays;
  }

  void begin_paths(PathMemory& m) const {
    m.vertices.clear();
    for (uint32_t i = 0; i < m.pixels.size(); ++i) {
      PathMemory::Pixel& pixel = m.pixels[i];
      const Vec3 direction(glm::normalize(camera_.ray(pixel.x, pixel.y).direction));
      if (gbuffer_.instance[pixel.index] == kNoInstance) {
        pixel.direct += lights_.background(direction);
        continue;
      }
      PathVertex vertex;
      vertex.point = surfaces_.of_pixel(gbuffer_, pixel.index);
      vertex.direction = direction;
      vertex.pixel = i;
      vertex.width = pixel_width(camera_, gbuffer_.view_z[pixel.index]) * samples_.width_px;
      m.vertices.push_back(vertex);
    }
  }

  /// A vertex with its number in its path, and the path's number in the pixel's sequence.
  struct Place {
    const PathVertex& vertex;
    uint32_t number, sample;
  };

  /// What shading a vertex needs of its surface.
  struct Shaded {
    ShadedSurface surface;
    Frame frame;
    Vec3 o;    ///< towards the viewer, in the frame
    Vec3 kept; ///< by specular reflection for diffuse reflection
    float eta; ///< of the far side relative to the near one
  };

  Shaded shaded(const PathVertex& vertex) const {
    const HitPoint& point = vertex.point;
    const SurfaceShading& shading = surfaces_.material(point).shading;
    Shaded s{ShadedSurface(shading, point.albedo), Frame(point.normal), Vec3(0), Vec3(1), shading.eta};
    s.o = s.frame.local(-vertex.direction);
    s.o.z = std::max(s.o.z, 1e-3f); // a shading normal may face away from the ray
    s.o = glm::normalize(s.o);
    const Vec3 factor = shading.bits & kSpecularTimesAlbedo ? point.albedo : Vec3(1.0f);
    s.kept = glm::max(Vec3(0.0f), Vec3(1.0f) - scene_.albedo(point.material).at(s.o.z) * factor);
    if (s.surface.transmits() && (shading.bits & kThin) == 0) s.eta = s.surface.relative_eta(point.outer);
    return s;
  }

  /// Adds the light that a surface emits, and the rays that leave it: to lights, for the ambient light, and one that
  /// continues the path.
  void shade(const Place& place, PathMemory& m) const {
    const Shaded s = shaded(place.vertex);
    add_emission(place, m);
    if (s.surface.scatters()) add_light(place, s, m);
    add_ambient(place, s, m);
    if (s.surface.reflects() || s.surface.transmits()) add_next(place, s, m);
  }

  void add_emission(const Place& place, PathMemory& m) const {
    const PathVertex& vertex = place.vertex;
    const Material& material = surfaces_.material(vertex.point);
    if (!material.shading.emits()) return;
    if (!vertex.point.outer && (material.flags & kEmitsBothSides) == 0) return;
    const Vec3 emission = material.shading.emission;
    if (place.number == 0) {
      m.pixels[vertex.pixel].direct += emission;
      return;
    }
    const float cosine = std::abs(glm::dot(vertex.point.geometric, vertex.direction));
    const float weight = vertex.density > 0.0f
                             ? power_weight(vertex.density, vertex.light_samples_before *
                                                                lights_.emitter_density(vertex.point.instance, emission,
                                                                                        vertex.distance, cosine))
                             : 1.0f;
    m.pixels[vertex.pixel].specular += vertex.throughput * emission * weight;
  }

  float light_samples(uint32_t number) const { return number == 0 ? static_cast<float>(config_.light_samples) : 1.0f; }

  Vec2 random(const Place& place, PathSamplers::Purpose purpose, const PathMemory& m, uint32_t sample) const {
    const PathMemory::Pixel& pixel = m.pixels[place.vertex.pixel];
    return samplers_.point(place.number, purpose, pixel.x, pixel.y, sample);
  }

  /// Adds rays to samples of the lights.
  void add_light(const Place& place, const Shaded& s, PathMemory& m) const {
    const PathVertex& vertex = place.vertex;
    const HitPoint& point = vertex.point;
    const bool continues = vertex.reflections < config_.depth;
    const auto count = static_cast<uint32_t>(light_samples(place.number));
    const float choice = random(place, PathSamplers::kLightChoice, m, place.sample).x;
    for (uint32_t j = 0; j < count; ++j) {
      const Vec2 u = random(place, PathSamplers::kLightPoint, m, place.sample * count + j);
      const LightSample light =
          lights_.sample(point.position, point.normal, (static_cast<float>(j) + choice) / static_cast<float>(count), u);
      if (light.radiance == Vec3(0.0f) || glm::dot(light.direction, point.geometric) <= 0.0f) continue;
      const Vec3 i = s.frame.local(light.direction);
      if (i.z <= 0.0f) continue;
      Vec3 f = s.surface.evaluate_specular(s.o, i, s.eta);
      if (continues && light.density > 0.0f && f != Vec3(0.0f))
        f *= power_weight(static_cast<float>(count) * light.density, reflection_density(s, glm::normalize(s.o + i)));
      f += s.surface.evaluate_diffuse(s.o, i, s.kept);
      const Vec3 radiance = vertex.throughput * f * light.radiance / static_cast<float>(count);
      if (radiance == Vec3(0.0f)) continue;
      constexpr float kBeforeLight = 1.0f - 1e-4f; // ends before the light's own surface
      m.shadows.add(surfaces_.leaving(point, light.direction, surfaces_.unit_length(light.distance) * kBeforeLight),
                    vertex.pixel, radiance);
    }
  }

  /// Adds the ambient light: of the camera's surface without occlusion, of others along a ray that may be occluded.
  void add_ambient(const Place& place, const Shaded& s, PathMemory& m) const {
    const PathVertex& vertex = place.vertex;
    const Vec3 ambient = s.surface.diffuse * s.kept * config_.ambient;
    if (ambient == Vec3(0.0f)) return;
    if (place.number == 0) {
      m.pixels[vertex.pixel].ambient += ambient;
      return;
    }
    const Vec2 u = random(place, PathSamplers::kAmbient, m, place.sample);
    Vec3 direction = s.frame.world(cosine_direction(u));
    if (const float below = glm::dot(direction, vertex.point.geometric); below < 0.0f)
      direction -= 2.0f * below * vertex.point.geometric;
    m.shadows.add(surfaces_.leaving(vertex.point, direction, surfaces_.unit_length(samples_.ambient_radius)),
                  vertex.pixel, vertex.throughput * ambient);
  }

  /// Light that a microfacet reflects and transmits.
  struct Split {
    Vec3 reflected, transmitted;
    float share; ///< probability of following the reflection
  };
  static Split split(const Shaded& s, float cosine) {
    Split result{s.surface.reflectance(cosine, s.eta), Vec3(0), 1.0f};
    if (!s.surface.transmits()) return result;
    const bool dielectric = s.surface.shading.fresnel() == kFresnelDielectric;
    result.transmitted = s.surface.transmission * (dielectric ? Vec3(1.0f - fresnel_dielectric(cosine, s.eta))
                                                              : glm::max(Vec3(0.0f), Vec3(1.0f) - result.reflected));
    if (s.surface.shading.bits & kThin) result.transmitted = s.surface.transmission;
    const float r = luminance(result.reflected), t = luminance(result.transmitted);
    result.share = r + t > 0.0f ? r / (r + t) : 1.0f;
    return result;
  }

  /// Density over solid angle of continuing a path by reflection at a microfacet.
  static float reflection_density(const Shaded& s, Vec3 half) {
    const float cosine = std::clamp(glm::dot(s.o, half), 0.0f, 1.0f);
    return split(s, cosine).share * Ggx{s.surface.shading.roughness}.reflected_density(s.o, half);
  }

  /// Continues a path by reflection or transmission.
  void add_next(const Place& place, const Shaded& s, PathMemory& m) const {
    const PathVertex& vertex = place.vertex;
    const HitPoint& point = vertex.point;
    const Ggx ggx{s.surface.shading.roughness};
    const bool rough = s.surface.rough();
    const Vec3 half =
        rough ? ggx.visible_normal(s.o, random(place, PathSamplers::kLobe, m, place.sample)) : Vec3(0, 0, 1);
    const Split parts = split(s, std::clamp(glm::dot(s.o, half), 0.0f, 1.0f));
    const bool reflects = random(place, PathSamplers::kLightChoice, m, place.sample).y < parts.share;
    PathVertex next;
    next.pixel = vertex.pixel;
    next.width = vertex.width;
    next.reflections = vertex.reflections + (reflects ? 1 : 0);
    next.transmissions = vertex.transmissions + (reflects ? 0 : 1);
    Vec3 i;
    if (reflects) {
      i = reflected(s.o, half);
      if (i.z <= 0.0f) return; // between microfacets
      next.throughput = vertex.throughput * parts.reflected / parts.share;
      if (rough) {
        next.throughput *= ggx.shadowing_masking(s.o, i) / ggx.masking(s.o);
        next.density = parts.share * ggx.reflected_density(s.o, half);
        next.normal_before = point.normal, next.light_samples_before = light_samples(place.number);
      }
    } else {
      i = s.surface.shading.bits & kThin ? -s.o : refracted(s.o, half, s.eta);
      if (i.z >= 0.0f) return;
      next.throughput = vertex.throughput * parts.transmitted / (1.0f - parts.share);
    }
    if (is_faint(next.throughput)) return;
    if (next.reflections > config_.depth || next.transmissions > 2 * config_.depth) {
      m.pixels[vertex.pixel].specular += next.throughput * config_.ambient;
      return;
    }
    next.direction =
        (reflects || (s.surface.shading.bits & kThin) == 0) ? glm::normalize(s.frame.world(i)) : vertex.direction;
    const float side = glm::dot(next.direction, point.geometric);
    if (reflects ? side < 0.0f : side > 0.0f) next.direction -= 2.0f * side * point.geometric;
    m.rays.push_back(surfaces_.leaving(point, next.direction, std::numeric_limits<float>::infinity()));
    m.next.push_back(next);
  }

  /// Traces the rays that continue the paths. Those that leave the scene see the background.
  void follow(PathMemory& m) const {
    m.hits.resize(m.rays.size());
    tracer_.closest_hits(m.rays, kCameraRays, RayOrder::kIncoherent, m.hits);
    m.vertices.clear(), m.hit_rays.clear(), m.valid_hits.clear(), m.widths.clear();
    for (size_t i = 0; i < m.rays.size(); ++i) {
      PathVertex& next = m.next[i];
      if (m.hits[i].valid()) {
        next.distance = surfaces_.world_length(m.hits[i].t);
        next.width += spread_ * next.distance;
        m.widths.push_back(next.width);
        m.vertices.push_back(next), m.hit_rays.push_back(m.rays[i]), m.valid_hits.push_back(m.hits[i]);
        continue;
      }
      const float weight =
          next.density > 0.0f
              ? power_weight(next.density,
                             next.light_samples_before * lights_.background_density(next.direction, next.normal_before))
              : 1.0f;
      m.pixels[next.pixel].specular += next.throughput * lights_.background(next.direction) * weight;
    }
    surfaces_.look_up(m.hit_rays, m.valid_hits, m.widths, m.points);
    for (size_t i = 0; i < m.vertices.size(); ++i) m.vertices[i].point = m.points[i];
  }

  const RayTracer& tracer_;
  const ShadeScene& scene_;
  const LightSet& lights_;
  const PrimaryCamera& camera_;
  const GBuffer& gbuffer_;
  const ShadeConfig& config_;
  const ShadeSamples& samples_;
  const HitSurfaces surfaces_;
  const PathSamplers samplers_;
  /// Growth of a path's cone per distance. Reflection and transmission keep it: they are taken as those of planes.
  const float spread_;
  ShadedFrame& frame_;
};

} // namespace

uint64_t trace_shading(const SceneSource& source, const RayTracer& tracer, const ShadeScene& scene,
                       const PrimaryCamera& camera, const GBuffer& gbuffer, const ShadeConfig& config,
                       const ShadeSamples& samples, ShadedFrame& frame, Progress& progress) {
  validate(config);
  frame.size = gbuffer.size;
  for (std::vector<Vec3>* layer : {&frame.direct, &frame.specular, &frame.ambient})
    layer->resize(gbuffer.size.pixels());
  const PathTracer paths(source, tracer, scene, camera, gbuffer, config, samples, frame);
  tbb::enumerable_thread_specific<PathMemory> memory;
  std::atomic<uint64_t> rays = 0;
  for_each_tile(gbuffer.size, progress,
                [&](const Tile& tile) { rays += paths.trace_tile(tile, memory.local(), progress); });
  return rays;
}

} // namespace packtrace
