#include "runtime/shade/light_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/gtc/matrix_transform.hpp>
#include <tbb/parallel_for.h>

#include "pbrt_import/scene/world_view.h"
#include "runtime/ao/hemisphere.h"
#include "runtime/shade/bsdf.h"

namespace packtrace {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

bool both_sides(const Material& material) { return (material.flags & kEmitsBothSides) != 0; }

constexpr uint32_t kNoEmitter = ~0u;

/// Finds a number in [0, 1) in cumulative shares, and stretches the rest to [0, 1).
std::pair<size_t, float> find_share(std::span<const float> steps, float u) {
  const auto i = static_cast<size_t>(std::upper_bound(steps.begin(), steps.end() - 1, u) - steps.begin());
  const float begin = i == 0 ? 0.0f : steps[i - 1], width = steps[i] - begin;
  return {i, width > 0.0f ? std::clamp((u - begin) / width, 0.0f, 0x1.fffffep-1f) : 0.0f};
}

/// Brightness of a spot light relative to its axis. Source: pbrt-v3, SpotLight::Falloff.
float spot_falloff(const Light& light, float cosine) {
  if (cosine < light.cos_outer) return 0.0f;
  if (cosine >= light.cos_inner) return 1.0f;
  const float t = (cosine - light.cos_outer) / (light.cos_inner - light.cos_outer);
  return t * t * t * t;
}

} // namespace

LightSet::LightSet(const SceneSource& source) : source_(source) {
  lights_.assign(source.lights().begin(), source.lights().end());
  environments_.reserve(source.environment_maps().size());
  for (const EnvironmentMap& map : source.environment_maps()) environments_.emplace_back(map);
  if (std::ranges::any_of(source.materials(), [](const Material& m) { return m.shading.emits(); })) add_emitters();
  if (lights_.empty() && emitters_.empty()) {
    Light sky;
    sky.kind = LightKind::kInfinite, sky.radiance = Vec3(kDefaultSky);
    lights_.push_back(sky);
    uses_sky_ = true;
  }
  choose_probabilities();
}

void LightSet::turn(float degrees) {
  if (degrees == turned_degrees_) return;
  turned_degrees_ = degrees;
  const std::span<const Light> at_rest = source_.lights();
  const DVec3 up = estimate_world_view(source_.cameras()).up, middle = source_.world_bounds().centre();
  const glm::dmat3 rotation(glm::rotate(glm::dmat4(1.0), glm::radians(double{degrees}), up));
  for (size_t i = 0; i < at_rest.size(); ++i) {
    lights_[i].position = middle + rotation * (at_rest[i].position - middle);
    lights_[i].direction = glm::mat3(rotation) * at_rest[i].direction;
    lights_[i].world_from_light = glm::mat3(rotation) * at_rest[i].world_from_light;
  }
}

void LightSet::add_emitters() {
  const auto instances = source_.instances();
  std::vector<std::vector<EmittingTriangle>> found(instances.size());
  tbb::parallel_for(size_t{0}, instances.size(), [&](size_t i) {
    const auto instance = static_cast<uint32_t>(i);
    if (!source_.may_emit(instance)) return;
    const uint32_t geometry = instances[i].geometry;
    const GeometryCounts counts = source_.counts(geometry);
    std::vector<Vec3> positions(counts.vertices);
    std::vector<Triangle> triangles(counts.triangles);
    source_.decode(geometry, positions, triangles);
    const DAffine placement(instances[i].world_from_object);
    const double mirrored = swaps_handedness(placement) ? -1.0 : 1.0;
    for (uint32_t t = 0; t < counts.triangles; ++t) {
      const uint32_t material = source_.material_of(instance, t);
      const SurfaceShading& shading = source_.materials()[material].shading;
      if (!shading.emits()) continue;
      DVec3 corners[3];
      for (int c = 0; c < 3; ++c) corners[c] = transform_point(placement, DVec3(positions[triangles[t][c]]));
      const DVec3 u = corners[1] - corners[0], v = corners[2] - corners[0];
      const DVec3 normal = glm::cross(u, v) * (shading.bits & kOuterSideOpposite ? -mirrored : mirrored);
      const double length = glm::length(normal);
      if (!(length > 0.0) || !std::isfinite(length)) continue;
      found[i].push_back({Vec3(corners[0]), Vec3(u), Vec3(v), Vec3(normal / length), material});
    }
  });
  emitter_of_.assign(instances.size(), kNoEmitter);
  for (size_t i = 0; i < found.size(); ++i) {
    if (found[i].empty()) continue;
    Emitter emitter{triangles_.size(), found[i].size(), 0.0};
    std::vector<double> sums;
    for (const EmittingTriangle& t : found[i]) {
      const double area = 0.5 * glm::length(glm::cross(DVec3(t.edge_u), DVec3(t.edge_v)));
      emitter.emitted += area * static_cast<double>(luminance(source_.materials()[t.material].shading.emission));
      sums.push_back(emitter.emitted);
    }
    if (!(emitter.emitted > 0.0) || !std::isfinite(emitter.emitted)) continue;
    for (const double sum : sums) triangle_steps_.push_back(static_cast<float>(sum / emitter.emitted));
    triangles_.insert(triangles_.end(), found[i].begin(), found[i].end());
    emitter_of_[i] = static_cast<uint32_t>(emitters_.size());
    emitters_.push_back(emitter);
  }
}

/// Half of the probability is the same for all lights, half follows their power: bright lights may be far away.
void LightSet::choose_probabilities() {
  const Bounds bounds = source_.world_bounds();
  const double radius = bounds.empty() ? 1.0 : std::max(0.5 * glm::length(bounds.hi - bounds.lo), 1e-30);
  const double disc = std::numbers::pi * radius * radius;
  std::vector<double> powers;
  for (const Light& light : lights_) {
    const auto brightness = static_cast<double>(luminance(light.radiance));
    switch (light.kind) {
    case LightKind::kPoint:
      powers.push_back(4.0 * std::numbers::pi * brightness);
      break;
    case LightKind::kSpot:
      powers.push_back(2.0 * std::numbers::pi * (1.0 - 0.5 * static_cast<double>(light.cos_outer + light.cos_inner)) *
                       brightness);
      break;
    case LightKind::kDistant:
      powers.push_back(disc * brightness);
      break;
    default:
      powers.push_back(
          std::numbers::pi * disc *
          static_cast<double>(luminance(map_of(light) ? light.radiance * map_of(light)->mean() : light.radiance)));
    }
  }
  for (const Emitter& emitter : emitters_) powers.push_back(std::numbers::pi * emitter.emitted);
  double total = 0.0, sum = 0.0;
  for (const double power : powers) total += power;
  for (const double power : powers) {
    const double equal = 1.0 / static_cast<double>(powers.size());
    const double probability = total > 0.0 ? 0.5 * equal + 0.5 * power / total : equal;
    probability_.push_back(static_cast<float>(probability));
    sum += probability;
    steps_.push_back(static_cast<float>(sum));
  }
}

LightSample LightSet::sample(Vec3 position, Vec3 normal, float choice, Vec2 point) const {
  const auto [light, rest] = find_share(steps_, choice);
  LightSample sample = light < lights_.size()
                           ? sample_light(lights_[light], map_of(lights_[light]), position, normal, point)
                           : sample_emitter(emitters_[light - lights_.size()], position, rest, point);
  sample.radiance /= probability_[light];
  sample.density *= probability_[light];
  return sample;
}

LightSample LightSet::sample_emitter(const Emitter& emitter, Vec3 position, float choice, Vec2 point) const {
  const auto steps = std::span(triangle_steps_).subspan(emitter.first, emitter.count);
  const EmittingTriangle& t = triangles_[emitter.first + find_share(steps, choice).first];
  const float root = std::sqrt(point.x);
  const Vec3 place = t.corner + t.edge_u * (1.0f - root) + t.edge_v * (point.y * root);
  const Vec3 way = place - position;
  const float distance = glm::length(way);
  if (!(distance > 0.0f)) return {};
  const Material& material = source_.materials()[t.material];
  const Vec3 direction = way / distance;
  const float cosine = -glm::dot(t.normal, direction);
  if (both_sides(material) ? cosine == 0.0f : cosine <= 0.0f) return {};
  LightSample sample{direction, distance, material.shading.emission, 0.0f};
  // Density of points: luminance / emitted.
  const double area_density = static_cast<double>(luminance(material.shading.emission)) / emitter.emitted;
  sample.density = static_cast<float>(area_density * static_cast<double>(distance) * static_cast<double>(distance) /
                                      static_cast<double>(std::abs(cosine)));
  sample.radiance /= sample.density;
  return sample;
}

LightSample LightSet::sample_light(const Light& light, const Environment* map, Vec3 position, Vec3 normal,
                                   Vec2 point) const {
  if (light.kind == LightKind::kDistant) return {light.direction, kFar, light.radiance, 0.0f};
  if (light.kind == LightKind::kInfinite) {
    SampledDirection chosen;
    if (map != nullptr) {
      chosen = map->sample(point);
      chosen.direction = light.world_from_light * chosen.direction;
    } else {
      const Vec3 local = cosine_direction(point);
      chosen = {turned_to(normal, local), local.z / kShadePi};
    }
    if (!(chosen.density > 0.0f)) return {};
    return {chosen.direction, kFar, radiance_of(light, map, chosen.direction) / chosen.density, chosen.density};
  }
  const Vec3 way = Vec3(light.position - DVec3(position));
  const float distance2 = glm::dot(way, way);
  if (!(distance2 > 0.0f)) return {};
  const float distance = std::sqrt(distance2);
  const Vec3 direction = way / distance;
  const float falloff =
      light.kind == LightKind::kSpot ? spot_falloff(light, -glm::dot(direction, light.direction)) : 1.0f;
  return {direction, distance, light.radiance * (falloff / distance2), 0.0f};
}

Vec3 LightSet::radiance_of(const Light& light, const Environment* map, Vec3 direction) const {
  return map != nullptr ? light.radiance * map->radiance(glm::transpose(light.world_from_light) * direction)
                        : light.radiance;
}

float LightSet::density_of(const Light& light, const Environment* map, Vec3 direction, Vec3 normal) {
  return map != nullptr ? map->density(glm::transpose(light.world_from_light) * direction)
                        : std::max(0.0f, glm::dot(direction, normal)) / kShadePi;
}

Vec3 LightSet::background(Vec3 direction) const {
  Vec3 sum(0.0f);
  for (const Light& light : lights_)
    if (light.kind == LightKind::kInfinite) sum += radiance_of(light, map_of(light), direction);
  return sum;
}

float LightSet::background_density(Vec3 direction, Vec3 normal) const {
  float sum = 0.0f;
  for (size_t i = 0; i < lights_.size(); ++i)
    if (lights_[i].kind == LightKind::kInfinite)
      sum += probability_[i] * density_of(lights_[i], map_of(lights_[i]), direction, normal);
  return sum;
}

float LightSet::emitter_density(uint32_t instance, Vec3 emission, float distance, float cosine) const {
  const uint32_t number = instance < emitter_of_.size() ? emitter_of_[instance] : kNoEmitter;
  if (number == kNoEmitter || !(cosine > 0.0f)) return 0.0f;
  const double chosen = static_cast<double>(probability_[lights_.size() + number]) / emitters_[number].emitted;
  return static_cast<float>(chosen * static_cast<double>(luminance(emission)) * static_cast<double>(distance) *
                            static_cast<double>(distance) / static_cast<double>(cosine));
}

} // namespace packtrace
