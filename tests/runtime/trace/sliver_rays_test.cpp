// Thin triangles of every direction, length and grid step: rays that start on one neither hit it again nor miss the
// surface below.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "tests/runtime/trace/embree_cluster_tracer.h"
#include "tests/runtime/trace/surface_rays.h"

namespace packtrace::test {
namespace {

constexpr double kSpacing = 1.5; ///< distance between the centres of needles of length 1

/// Needles of length 1 in various directions, too far apart to intersect.
Mesh needles(double aspect, Random& random) {
  Mesh mesh;
  const double d = 1.0 / std::sqrt(2.0), e = 1.0 / std::sqrt(3.0);
  std::vector<DVec3> directions = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {d, d, 0}, {0, -d, d}, {e, e, e}, {-e, e, e}};
  while (directions.size() < 18) directions.push_back(random_direction(random));
  for (size_t i = 0; i < directions.size(); ++i) {
    const auto at = static_cast<double>(i);
    add_needle(mesh, DVec3(std::fmod(at, 3.0), std::fmod(std::floor(at / 3.0), 3.0), std::floor(at / 9.0)) * kSpacing,
               directions[i], 1.0, 1.0 / aspect, random);
  }
  return mesh;
}

struct Places {
  bool instanced;
  double aspect; ///< length over thickness of the needles
  double step;   ///< grid step, in units of their thickness
};

Scene scene_of(const Places& places, Random& random) {
  Scene scene;
  if (!places.instanced) {
    add_shape(scene, needles(places.aspect, random));
    return scene;
  }
  add_object(scene, needles(places.aspect, random));
  scene.instances.push_back({0, Affine(placed({1, 2, 3}, {1, 1.3, -0.8}, 33, {1, 2, 3}))});
  scene.instances.push_back({0, Affine(placed({40, -7, 11}, DVec3(1), 80, {3, 1, 2}))});
  return scene;
}

struct Counts {
  size_t places = 0;
  size_t up = 0, up_occluded = 0;   ///< rays away from the body, which must hit nothing
  size_t down = 0, down_missed = 0; ///< rays into the body, which must hit it
};

/// The triangles of a geometry and, for each, the centre of its needle.
struct Surface {
  std::vector<std::array<DVec3, 3>> triangles;
  std::vector<DVec3> middles;
};

Surface surface_of(const SceneSource& source, uint32_t geometry) {
  const GeometryCounts sizes = source.counts(geometry);
  std::vector<Vec3> positions(sizes.vertices);
  std::vector<Triangle> triangles(sizes.triangles);
  source.decode(geometry, positions, triangles);
  Surface surface;
  using Cell = std::array<long, 3>;
  // Each corner is in three triangles of its needle, so all corners have the same weight.
  std::map<Cell, std::pair<DVec3, double>> needles;
  std::vector<Cell> cells;
  for (const Triangle& t : triangles) {
    surface.triangles.push_back({DVec3(positions[t.x]), DVec3(positions[t.y]), DVec3(positions[t.z])});
    const DVec3 at = surface.triangles.back()[0] / kSpacing;
    cells.push_back({std::lround(at.x), std::lround(at.y), std::lround(at.z)});
    auto& [sum, count] = needles[cells.back()];
    for (const DVec3 corner : surface.triangles.back()) sum += corner, count += 1.0;
  }
  for (const Cell& cell : cells) surface.middles.push_back(needles[cell].first / needles[cell].second);
  return surface;
}

Counts trace_rays(const RayTracer& tracer, const SceneSource& source, double thickness, Random& random) {
  Counts counts;
  std::vector<Ray> up, down;
  for (const PlacedGeometry& instance : source.instances()) {
    const Surface surface = surface_of(source, instance.geometry);
    const DAffine world_from_object(instance.world_from_object);
    for (size_t t = 0; t < surface.triangles.size(); ++t) {
      std::array<DVec3, 3> p = surface.triangles[t];
      for (DVec3& corner : p) corner = transform_point(world_from_object, corner);
      const DVec3 inwards = transform_point(world_from_object, surface.middles[t]) - p[0];
      DVec3 normal = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
      if (glm::dot(normal, inwards) > 0.0) normal = -normal;
      if (!(glm::dot(normal, inwards) < -0.1 * thickness)) continue; // The needle has almost no volume.
      for (int i = 0; i < 40; ++i) {
        const double a = uniform(random, 0, 1), b = uniform(random, 0, 1 - a);
        const DVec3 target = p[0] + (p[1] - p[0]) * a + (p[2] - p[0]) * b;
        const std::optional<Place> place = place_on(tracer, target, target + normal * (4.0 * thickness));
        // A ray that meets an edge, up to rounding errors, may hit the inner side of the triangle behind it.
        if (!place || place->triangle != t) continue;
        ++counts.places;
        for (int k = 0; k < 8; ++k) {
          DVec3 direction = random_direction(random);
          if (glm::dot(direction, place->normal) < 0.0) direction = -direction;
          up.push_back(start_at(*place, direction, 0.1, tracer.space()));
        }
        // Only where the body is much thicker than the origin's rounding error.
        if (place->offset < 0.01 * thickness)
          down.push_back(start_at(*place, -place->normal, 2.0 * thickness, tracer.space()));
      }
    }
  }
  const auto occluded = [&](std::span<const Ray> rays) {
    return static_cast<size_t>(std::ranges::count(any(tracer, rays), 1));
  };
  counts.up = up.size(), counts.up_occluded = occluded(up);
  counts.down = down.size(), counts.down_missed = down.size() - occluded(down);
  return counts;
}

class SliverRays : public testing::TestWithParam<Places> {};

TEST_P(SliverRays, LeaveTheSurfaceThatTheyStartOn) {
  const Places& places = GetParam();
  const double thickness = 1.0 / places.aspect;
  Random random(7);
  const Scene scene = scene_of(places, random);
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = places.step * thickness;
  const BakedScene baked(scene, config);
  std::vector<std::unique_ptr<RayTracer>> tracers;
  tracers.push_back(std::make_unique<EmbreeTracer>(baked.source, EmbreeConfig{}));
  for (const PackedIsa isa : isas()) tracers.push_back(std::make_unique<PackedTracer>(baked.file, baked.source, isa));
  tracers.push_back(std::make_unique<EmbreeClusterTracer>(baked.file, baked.source));
  for (const auto& tracer : tracers) {
    Random rays(5);
    const Counts counts = trace_rays(*tracer, baked.source, thickness, rays);
    const std::string name = std::string(tracer->name()) + " " + std::string(tracer->isa());
    EXPECT_GT(counts.places, 500u) << name;
    // Bodies may be thinner than a float's ulp at their position.
    const double share = places.aspect > 1e5 ? 1e-4 : 0.0;
    EXPECT_LE(static_cast<double>(counts.up_occluded), share * static_cast<double>(counts.up))
        << name << ", " << counts.up_occluded;
    EXPECT_LE(counts.down_missed, 2 + counts.down / 1000) << name << ", of " << counts.down;
  }
}

std::vector<Places> all_places() {
  std::vector<Places> result;
  for (const bool instanced : {false, true})
    for (const double aspect : {1e2, 1e3, 1e4, 1e5, 1e6})
      for (const double step : {0.25, 0.05, 0.01}) result.push_back({instanced, aspect, step});
  return result;
}

std::string test_name(const testing::TestParamInfo<Places>& info) {
  const auto digits = [](double x) { return std::to_string(std::lround(x)); };
  return std::string(info.param.instanced ? "Instanced" : "World") + "Aspect" + digits(info.param.aspect) + "Steps" +
         digits(1.0 / info.param.step);
}

INSTANTIATE_TEST_SUITE_P(Needles, SliverRays, testing::ValuesIn(all_places()), test_name);

} // namespace
} // namespace packtrace::test
