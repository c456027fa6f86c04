// Convex bodies that non-uniform transforms stretch and press by up to 1e6: no ray that starts on one hits it again.

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "tests/runtime/trace/embree_cluster_tracer.h"
#include "tests/runtime/trace/surface_rays.h"

namespace packtrace::test {
namespace {

struct Stretch {
  const char* name;
  DVec3 scale;
  bool instanced;
  bool turned; ///< whether the body is turned after scaling, so that no axis of the world is one of its own
};

void PrintTo(const Stretch& stretch, std::ostream* out) { *out << stretch.name; }

Scene scene_of(const Stretch& stretch, Random& random) {
  Mesh body;
  add_needle(body, DVec3(0.0), random_direction(random), 1.0, 0.3, random);
  const DAffine scaled = placed(DVec3(0.0), stretch.scale);
  const DAffine turned =
      placed(DVec3(0.0), DVec3(1.0), stretch.turned ? uniform(random, 0, 360) : 0.0, random_direction(random));
  const DAffine world_from_body = compose(turned, scaled);
  Scene scene;
  if (stretch.instanced) {
    add_object(scene, body);
    scene.instances.push_back({0, Affine(world_from_body)});
  } else {
    add_shape(scene, body, 0, world_from_body);
  }
  return scene;
}

using Corners = std::array<DVec3, 3>;

/// The triangles of a scene with one instance, in the world.
std::vector<Corners> world_triangles_of(const SceneSource& source) {
  const GeometryCounts sizes = source.counts(0);
  std::vector<Vec3> positions(sizes.vertices);
  std::vector<Triangle> triangles(sizes.triangles);
  source.decode(0, positions, triangles);
  const DAffine world_from_object(source.instances()[0].world_from_object);
  std::vector<Corners> result;
  for (const Triangle& t : triangles) {
    Corners& corners = result.emplace_back();
    for (int i = 0; i < 3; ++i)
      corners[static_cast<size_t>(i)] = transform_point(world_from_object, DVec3(positions[t[i]]));
  }
  return result;
}

/// A random direction above a surface. Half of the directions are nearly parallel to an edge, where a ray stays near a
/// needle for longest.
DVec3 direction_above(DVec3 normal, DVec3 edge, Random& random) {
  for (;;) {
    DVec3 direction = random_direction(random);
    if (uniform(random, 0, 1) < 0.5)
      direction = glm::normalize(glm::normalize(edge) * (uniform(random, -1, 1) < 0.0 ? -1.0 : 1.0) +
                                 direction * std::pow(10.0, -uniform(random, 0, 6)));
    if (glm::dot(direction, normal) < 0.0) direction = -direction;
    if (glm::dot(direction, normal) > 1e-4) return direction; // lower ones reach the ground by rounding
  }
}

struct HitsAgain {
  size_t rays = 0, hits = 0;
};

HitsAgain trace_rays(const RayTracer& tracer, const SceneSource& source, Random& random) {
  std::vector<Ray> rays;
  const std::vector<Corners> triangles = world_triangles_of(source);
  DVec3 middle(0.0);
  for (const Corners& p : triangles) middle += (p[0] + p[1] + p[2]) / (3.0 * static_cast<double>(triangles.size()));
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    const Corners& p = triangles[t];
    DVec3 normal = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
    const double depth = glm::dot(normal, p[0] - middle);
    if (depth < 0.0) normal = -normal;
    for (int i = 0; i < 100; ++i) {
      // Near edges, and at all distances from the corners.
      const double a = std::pow(uniform(random, 0, 1), 3.0), b = (1.0 - a) * std::pow(10.0, -uniform(random, 0, 4));
      const DVec3 target = p[0] + (p[1] - p[0]) * a + (p[2] - p[0]) * b;
      const std::optional<Place> place = place_on(tracer, target, target + normal * (8.0 * std::abs(depth)));
      // A ray that meets an edge, up to rounding errors, may hit the inner side of the triangle behind it.
      if (!place || place->triangle != t) continue;
      for (int k = 0; k < 16; ++k)
        rays.push_back(start_at(*place, direction_above(place->normal, p[1] - p[0], random), 1e9, tracer.space()));
    }
  }
  return {rays.size(), static_cast<size_t>(std::ranges::count(any(tracer, rays), 1))};
}

class StretchedBodies : public testing::TestWithParam<Stretch> {};

TEST_P(StretchedBodies, AreNotHitByRaysThatStartOnThem) {
  const Stretch& stretch = GetParam();
  std::map<std::string, HitsAgain> found;
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    BakeConfig config; // with a step of 1/64 of the smallest scale, so that thin bodies keep their thickness
    config.precision_kind = PrecisionKind::kAbsolute;
    config.precision = std::min({std::abs(stretch.scale.x), std::abs(stretch.scale.y), std::abs(stretch.scale.z)}) / 64;
    const BakedScene baked(scene_of(stretch, random), config);
    std::vector<std::unique_ptr<RayTracer>> tracers;
    tracers.push_back(std::make_unique<EmbreeTracer>(baked.source, EmbreeConfig{}));
    for (const PackedIsa isa : isas()) tracers.push_back(std::make_unique<PackedTracer>(baked.file, baked.source, isa));
    tracers.push_back(std::make_unique<EmbreeClusterTracer>(baked.file, baked.source));
    for (const auto& tracer : tracers) {
      Random rays(seed);
      const HitsAgain now = trace_rays(*tracer, baked.source, rays);
      HitsAgain& all = found[std::string(tracer->name()) + " " + std::string(tracer->isa())];
      all.rays += now.rays, all.hits += now.hits;
    }
  }
  for (const auto& [name, result] : found) {
    EXPECT_GT(result.rays, 10000u) << name;
    // In the world, the middle of a turned needle may be thinner than a float's ulp at its position.
    const double share = stretch.turned && !stretch.instanced ? 2e-5 : 0.0;
    EXPECT_LE(static_cast<double>(result.hits), share * static_cast<double>(result.rays))
        << name << ", " << result.hits;
  }
}

std::vector<Stretch> stretches() {
  std::vector<Stretch> result;
  const std::pair<const char*, DVec3> scales[] = {{"Long1e3", {1e3, 1, 1}},     {"Long1e6", {1, 1e6, 1}},
                                                  {"Flat1e3", {1, 1, 1e-3}},    {"Flat1e6", {1e-6, 1, 1}},
                                                  {"Thin1e6", {1e-6, 1, 1e-6}}, {"Wide1e6", {1e6, 1, 1e6}},
                                                  {"Mixed1e6", {1e-3, 1, 1e3}}, {"Mirrored1e6", {-1e6, 1, -1e-2}}};
  for (const auto& [name, scale] : scales)
    for (const bool instanced : {false, true})
      for (const bool turned : {false, true}) result.push_back({name, scale, instanced, turned});
  return result;
}

std::string stretch_name(const testing::TestParamInfo<Stretch>& info) {
  return std::string(info.param.name) + (info.param.turned ? "Turned" : "") +
         (info.param.instanced ? "Instanced" : "World");
}

INSTANTIATE_TEST_SUITE_P(Bodies, StretchedBodies, testing::ValuesIn(stretches()), stretch_name);

} // namespace
} // namespace packtrace::test
