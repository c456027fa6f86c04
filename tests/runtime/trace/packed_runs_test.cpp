// Runs of camera rays, and groups of other sizes, find what their rays find alone.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "runtime/trace/packed/scene/packed_tracer.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::any;
using test::BakedScene;
using test::closest;
using test::cone;
using test::isas;
using test::placed;
using test::quad;
using test::sphere;

constexpr size_t kRun = 64;   ///< rays of a run
constexpr size_t kUnread = 5; ///< a ray of a run that the early test of its corners does not read

/// Expects that rays find together, bit for bit, what each finds alone. Returns the number of hits.
size_t trace_alone_too(const PackedTracer& tracer, const std::vector<Ray>& rays) {
  const std::vector<RayHit> together = closest(tracer, rays);
  size_t hits = 0, different = 0;
  for (size_t i = 0; i < rays.size(); i += test::sanitized() ? 13 : 1) {
    RayHit alone;
    tracer.closest_hits({&rays[i], 1}, kCameraRays, RayOrder::kCoherent, {&alone, 1});
    different += std::memcmp(&together[i], &alone, sizeof alone) != 0;
    hits += alone.valid();
  }
  EXPECT_EQ(different, 0u) << tracer.isa();
  return hits;
}

/// The rays of a cone, of which some end early. All begin at their origin, as the rays of a run must share tnear.
size_t trace_cone(const PackedTracer& tracer, const DVec3& from, const DVec3& towards, double width) {
  std::vector<Ray> rays = cone(tracer.space(), from, towards, width);
  for (Ray& ray : rays) ray.tnear = 0.0f;
  return trace_alone_too(tracer, rays);
}

/// Runs of camera rays are culled by bounds of all directions before they are transformed, and coincident instances
/// have hits of equal t, of which the first counts.
TEST(PackedRuns, BesideOneBodyAndThroughCoincidentOnesFindWhatTheirRaysFind) {
  Scene one, coincident;
  add_shape(one, sphere({0, 1, 0}, 1, 24));
  const uint32_t ball = add_object(coincident, sphere({0, 0, 0}, 1, 24));
  for (const double turn : {0.0, 0.0, 30.0})
    coincident.instances.push_back({ball, Affine(placed({0, 1, 0}, DVec3(1.0), turn))});
  coincident.instances.push_back({ball, Affine(placed({4, 1, 0}, DVec3(1.0, -0.5, 2.0), 77.0))});
  for (const Scene* const scene : {&one, &coincident}) {
    const BakedScene baked(*scene);
    for (const PackedIsa isa : isas()) {
      const PackedTracer tracer(baked.file, baked.source, isa);
      size_t hits = 0, rays = 0;
      for (const DVec3& from : {DVec3(0, 1, 0), DVec3(0.3, 1.2, -5), DVec3(-900, 1.5, 0.1), DVec3(1.001, 1, 0)})
        for (const DVec3& towards : {DVec3(0.01, 0, 1), DVec3(1, -0.0002, -0.0001), DVec3(-0.6, -0.2, -0.7)})
          for (const double width : {0.001, 0.1, 1.0})
            hits += trace_cone(tracer, from, towards, width), rays += 64 * 64;
      if (test::sanitized()) rays /= 13;
      EXPECT_GT(hits, rays / 5);
      EXPECT_LT(hits, 9 * rays / 10);
    }
  }
}

/// Origins far away are moved to the tree. In floats they may then be equal, and their roundings differ.
TEST(PackedRuns, NarrowOnesFromFarAwayFindWhatTheirRaysFind) {
  Scene scene;
  add_shape(scene, sphere({0, 1, 0}, 1, 24));
  const BakedScene baked(scene);
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    size_t hits = 0;
    for (const double away : {1e1, 1e3, 1e5})
      for (const double width : {1e-9, 3e-9, 1e-8, 3e-8, 1e-7})
        for (const double aside : {0.1, 0.7, 0.99})
          hits += trace_cone(tracer, {aside, 1.0 + 0.1 * aside, -away}, {0, 0, 1}, width);
    EXPECT_GT(hits, 10000u);
  }
}

/// A sphere behind a masked quad, seen from (0, 1, -5).
Scene masked_scene() {
  Scene scene;
  add_shape(scene, quad({-3, -2, -2}, {6, 0, 0}, {0, 6, 0}), kAlphaMask);
  scene.masks.push_back({64, 1, WrapMode::kRepeat, Vec2(4, 1), Vec2(0), {0u, ~0u}});
  scene.materials[0].alpha_mask = 0;
  add_shape(scene, sphere({0, 1, 0}, 1, 24));
  return scene;
}

Scene plain_scene() {
  Scene scene;
  add_shape(scene, sphere({0, 1, 0}, 1, 24));
  add_object(scene, sphere({0, 0, 0}, 1, 24));
  scene.instances.push_back({0, Affine(placed({1.5, 1, 1}, DVec3(1.0, -0.5, 2.0), 77.0))});
  return scene;
}

/// A huge triangle among small ones makes the tree graded.
Scene graded_scene() {
  Scene scene;
  add_shape(scene, sphere({0, 1, 0}, 1, 24));
  add_shape(scene, quad({-3e6f, -2, -3e6f}, {0, 0, 6e6f}, {6e6f, 0, 0}));
  return scene;
}

struct RunCase {
  const char* name;
  Scene (*scene)();
  /// Changes a ray.
  /// @param number within its run
  /// @param unit t of a distance of 1 in the scene
  void (*change)(Ray& ray, size_t number, float unit);
  double away = 5.0, width = 0.4;
  bool graded = false;
};

void keep(Ray&, size_t, float) {}

void scale(Ray& ray, float factor) { ray.direction = ray.direction * factor; }

template <int kAxis, size_t kValue>
void set_component(Ray& ray, size_t number, float) {
  constexpr float kValues[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -0.0f};
  if (number == kUnread) ray.direction[kAxis] = std::copysign(kValues[kValue], ray.direction[kAxis]);
}

const RunCase kRunCases[] = {
    {"Plain", plain_scene, keep},
    {"Masked", masked_scene, keep},
    {"Graded", graded_scene, keep, 5.0, 0.4, true},
    {"DirectionsOf2To70", plain_scene, [](Ray& ray, size_t, float) { scale(ray, 0x1p70f); }},
    {"DirectionsOf2ToMinus70", plain_scene, [](Ray& ray, size_t, float) { scale(ray, 0x1p-70f); }},
    {"MovedOrigins", plain_scene, keep, 500.0, 0.003},
    {"ShortDirectionsFromFarAway", plain_scene, [](Ray& ray, size_t, float) { scale(ray, 0x1p-59f); }, 0x1p39, 0x1p-39},
    {"OneShortDirection", plain_scene,
     [](Ray& ray, size_t number, float) {
       if (number == kUnread) scale(ray, 0x1p-90f);
     }},
    {"NanAlongX", plain_scene, set_component<0, 0>},
    {"NanAlongZ", plain_scene, set_component<2, 0>},
    {"InfiniteAlongX", plain_scene, set_component<0, 1>},
    {"InfiniteAlongZ", plain_scene, set_component<2, 1>},
    {"ZeroAlongX", plain_scene, set_component<0, 2>},
    {"MinusZeroAlongX", plain_scene,
     [](Ray& ray, size_t number, float) {
       if (number == kUnread) ray.direction.x = -0.0f;
     }},
    {"OneOtherOrigin", plain_scene,
     [](Ray& ray, size_t number, float unit) {
       if (number == kUnread) ray.origin.x += 0.5f * unit;
     }},
    // 4.5 is inside the sphere.
    {"OneOtherBegin", plain_scene,
     [](Ray& ray, size_t number, float unit) {
       if (number == kUnread) ray.tnear = 4.5f * unit;
     }},
    {"CommonBeginInsideTheSphere", plain_scene, [](Ray& ray, size_t, float unit) { ray.tnear = 4.5f * unit; }},
    {"EndsOfTheirOwn", plain_scene,
     [](Ray& ray, size_t number, float unit) { ray.tfar = (number % 3 == 0 ? 4.2f : 6.5f) * unit; }},
    {"EmptyRange", plain_scene,
     [](Ray& ray, size_t number, float) {
       if (number == kUnread) ray.tnear = 2.0f, ray.tfar = 1.0f;
     }},
    {"RangeOfNan", plain_scene,
     [](Ray& ray, size_t number, float) {
       if (number == kUnread) ray.tfar = std::numeric_limits<float>::quiet_NaN();
     }},
};

class PackedRunsOf : public testing::TestWithParam<RunCase> {};

TEST_P(PackedRunsOf, FindWhatTheirRaysFind) {
  const RunCase& of = GetParam();
  BakeConfig config;
  if (of.graded) config.precision_kind = PrecisionKind::kEdgeFraction, config.precision = 1e-3;
  const BakedScene baked(of.scene(), config);
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    if (of.graded) {
      ASSERT_TRUE(std::ranges::any_of(tracer.trees(), [](const packed::TraceTree& tree) { return tree.graded != 0; }));
    }
    std::vector<Ray> rays = cone(tracer.space(), {0, 1, -of.away}, {0, 0, 1}, of.width);
    for (size_t i = 0; i < rays.size(); ++i) {
      rays[i].tnear = 0.0f, rays[i].tfar = std::numeric_limits<float>::infinity();
      of.change(rays[i], i % kRun, static_cast<float>(tracer.space().scale()));
    }
    const size_t hits = trace_alone_too(tracer, rays), traced = test::sanitized() ? rays.size() / 13 : rays.size();
    EXPECT_GT(hits, traced / 10);
  }
}

INSTANTIATE_TEST_SUITE_P(PackedRuns, PackedRunsOf, testing::ValuesIn(kRunCases),
                         [](const auto& info) { return std::string(info.param.name); });

/// Any hits of few rays in a leaf are found ray by ray, those of more rays in registers of several rays.
TEST(PackedRuns, AnyHitsAreTheSameAloneInThreesInFoursAndInGroups) {
  const BakedScene baked(test::varied_scene());
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    for (const double width : {0.05, 0.5, 3.0}) {
      const std::vector<Ray> rays = cone(tracer.space(), {0, 2, -7}, {0, -0.1, 1}, width);
      const std::vector<uint8_t> expected = any(tracer, rays);
      const auto occluded = static_cast<size_t>(std::ranges::count(expected, 1));
      EXPECT_GT(occluded, rays.size() / 10);
      EXPECT_LT(occluded, rays.size());
      for (const size_t portion : {size_t{1}, size_t{3}, size_t{4}, kRun}) {
        std::vector<uint8_t> found(rays.size());
        for (size_t at = 0; at < rays.size(); at += portion) {
          const size_t count = std::min(portion, rays.size() - at);
          tracer.any_hits({&rays[at], count}, kOcclusionRays, RayOrder::kCoherent, {&found[at], count});
        }
        EXPECT_EQ(found, expected) << tracer.isa() << ", portions of " << portion;
      }
    }
  }
}

} // namespace
} // namespace packtrace
