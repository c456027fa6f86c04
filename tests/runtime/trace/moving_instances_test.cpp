#include <cstring>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/camera/lod_view.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "runtime/trace/source/lod_source.h"
#include "tests/runtime/trace/moving_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::BakedScene;
using test::closest;
using test::isas;
using test::MovedSource;
using test::movers_from;
using test::placed;
using test::random_rays;
using test::transforms_of;

const Bounds kRoom{{-12, -6, -12}, {12, 12, 12}};
constexpr uint32_t kStill = 2; ///< number of instances in world space

/// A floor and a masked wall in world space, and instances of a sphere and of a box.
Scene room_of(uint32_t count) {
  Scene scene;
  test::add_shape(scene, test::quad({-8, 0, -8}, {0, 0, 16}, {16, 0, 0}));
  test::add_shape(scene, test::quad({-4, 0, 4}, {8, 0, 0}, {0, 5, 0}), kAlphaMask);
  scene.masks.push_back({64, 1, WrapMode::kRepeat, Vec2(4, 1), Vec2(0), {0u, ~0u}});
  scene.materials[1].alpha_mask = 0;
  test::add_object(scene, test::sphere({0, 0, 0}, 1, 24));
  test::add_object(scene, test::box({-1, -0.5f, -0.7f}, {1, 0.5f, 0.7f}));
  for (uint32_t i = 0; i < count; ++i)
    scene.instances.push_back({i % 2, Affine(placed({i % 13 - 6.0, 1, i % 17 - 8.0}, DVec3(1), 10.0 * i))});
  return scene;
}

class RandomMotion {
public:
  explicit RandomMotion(uint32_t seed) : generator_(seed) {}

  Affine next() {
    const int kind = static_cast<int>(generator_() % 8);
    const double size = 0.3 + unit();
    DVec3 scale(size, size * (0.5 + unit()), kind == 0 ? -size : size);
    if (kind == 1) scale.y = 0.0;
    if (kind == 2) scale = DVec3(0.0);
    const double angle = kind == 3 ? 0.0 : 360.0 * unit(); // aligned with the axes
    return Affine(placed({16 * unit() - 8, 6 * unit() - 1, 16 * unit() - 8}, scale, angle, {unit(), 1, unit()}));
  }

private:
  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(generator_); }
  std::mt19937 generator_;
};

/// The hits of two tracers must be the same to the bit, on the same triangles of the same instances.
void expect_same_hits(const RayTracer& moved, const RayTracer& fresh, std::span<const Ray> rays) {
  for (const uint32_t ray_class : {kCameraRays, kOcclusionRays}) {
    const std::vector<RayHit> a = closest(moved, rays, ray_class), b = closest(fresh, rays, ray_class);
    size_t hits = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(a[i].valid(), b[i].valid()) << moved.name() << " ray " << i;
      if (!a[i].valid()) continue;
      ++hits;
      ASSERT_EQ(std::memcmp(&a[i], &b[i], 3 * sizeof(float)), 0) << moved.name() << " ray " << i;
      const HitSurface sa = moved.resolve(a[i]), sb = fresh.resolve(b[i]);
      ASSERT_EQ(sa.placement->instance, sb.placement->instance);
      ASSERT_EQ(sa.triangle, sb.triangle);
      ASSERT_EQ(std::memcmp(sa.vertices, sb.vertices, sizeof(sa.vertices)), 0);
      ASSERT_EQ(sa.placement->unit_from_surface, sb.placement->unit_from_surface);
      ASSERT_EQ(sa.placement->object_normal, sb.placement->object_normal);
      ASSERT_EQ(sa.placement->moved_linear, sb.placement->moved_linear);
    }
    EXPECT_GT(hits, rays.size() / 12);
    EXPECT_EQ(test::any(moved, rays, ray_class), test::any(fresh, rays, ray_class));
  }
}

/// Moves some or all movers for several frames and compares with tracers that are made with the new transforms.
template <typename Make>
void expect_moves_like_new(const SceneSource& source, const Movers& movers, const Make& make) {
  const std::unique_ptr<RayTracer> tracer = make(source);
  std::vector<Affine> now = transforms_of(source);
  RandomMotion motion(7);
  const std::vector<Ray> rays = random_rays(test::fewer(6000u), {{-9, -1, -9}, {9, 7, 9}}, tracer->space());
  const uint32_t frames = test::sanitized() ? 2 : 6; // of all movers and of some
  for (uint32_t frame = 0; frame < frames; ++frame) {
    std::vector<uint32_t> instances;
    std::vector<Affine> places;
    for (const uint32_t i : movers.instances) {
      if (frame % 2 == 1 && i % 3 != 0) continue;
      instances.push_back(i);
      places.push_back(now[i] = motion.next());
    }
    tracer->place_instances(instances, places);
    const MovedSource moved(source, now);
    const std::unique_ptr<RayTracer> fresh = make(moved);
    ASSERT_EQ(tracer->space(), fresh->space());
    EXPECT_TRUE(std::ranges::equal(tracer->flat_instances(), fresh->flat_instances()));
    EXPECT_TRUE(std::ranges::equal(tracer->world_from_object(), now));
    expect_same_hits(*tracer, *fresh, rays);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(MovingInstances, ArePlacedAsInANewTracer) {
  for (const uint32_t count : {1u, 7u, 8u, 9u, 60u}) {
    SCOPED_TRACE(count);
    const BakedScene baked(room_of(count));
    const Movers movers = movers_from(kStill, baked.source, kRoom);
    for (const PackedIsa isa : isas())
      expect_moves_like_new(baked.source, movers, [&](const SceneSource& source) {
        return std::make_unique<PackedTracer>(baked.file, source, isa, movers);
      });
    expect_moves_like_new(baked.source, movers, [&](const SceneSource& source) {
      return std::make_unique<EmbreeTracer>(source, EmbreeConfig{}, movers);
    });
  }
}

TEST(MovingInstances, AreTracedAsByATracerWithoutMovers) {
  const BakedScene baked(room_of(40));
  const Movers movers = movers_from(kStill, baked.source, kRoom);
  PackedTracer tracer(baked.file, baked.source, chosen_isa(), movers);
  std::vector<Affine> now = transforms_of(baked.source);
  RandomMotion motion(3);
  for (const uint32_t i : movers.instances) now[i] = motion.next();
  // Something in a corner makes the space of both the same.
  now[kStill] = Affine(placed({11, 11, 11}, DVec3(0.5)));
  tracer.place_instances(movers.instances, std::span(now).subspan(kStill));
  const MovedSource moved(baked.source, now);
  const PackedTracer fresh(baked.file, moved);
  ASSERT_EQ(tracer.space(), fresh.space());
  const std::vector<Ray> rays = random_rays(test::fewer(20000u), {{-9, -1, -9}, {9, 7, 9}}, tracer.space());
  expect_same_hits(tracer, fresh, rays);
}

TEST(MovingInstances, OfLevelsOfDetailArePlacedAsInANewTracer) {
  Scene scene = room_of(0);
  test::add_object(scene, test::sphere({0, 0, 0}, 1, 40));
  for (int i = 0; i < 12; ++i) scene.instances.push_back({2, Affine(placed({i - 6.0, 1, 2.0 * i - 8}))});
  BakeConfig config;
  config.lod = LodUse::kAll;
  const BakedScene baked(scene, config);
  const std::vector<LodGeometry> geometries = lod_geometries(baked.file);
  const std::vector<LodInstance> instances = lod_instances(baked.source);
  LodSharing sharing(geometries, instances, {});
  const PrimaryCamera camera(test::camera_at({1, 3, -10}, {0, 1, 0}), {96, 64});
  const LodPlan plan = sharing.plan(detail_view(camera, baked.file.world_bounds(), 2.0));
  const LodSource source(baked.file, baked.source, sharing, plan);
  const Movers movers = movers_from(kStill, source, kRoom);
  std::vector<Affine> now = transforms_of(source);
  RandomMotion motion(5);
  const auto moved = [&](RayTracer& tracer) {
    tracer.place_instances(movers.instances, std::span(now).subspan(kStill));
  };
  for (const uint32_t i : movers.instances) now[i] = motion.next();
  PackedTracer once(baked.file, source, chosen_isa(), movers), twice(baked.file, source, chosen_isa(), movers);
  EmbreeTracer embree(source, {}, movers);
  const std::vector<Ray> rays = random_rays(6000, {{-9, -1, -9}, {9, 7, 9}}, once.space());
  moved(twice);
  for (const uint32_t i : movers.instances) now[i] = motion.next();
  moved(once), moved(twice), moved(embree);
  expect_same_hits(twice, once, rays);
  // The chosen clusters at the same places, traced by Embree.
  const MovedSource placed_there(source, now);
  expect_same_hits(embree, EmbreeTracer(placed_there, {}, movers), rays);
  const std::vector<RayHit> a = closest(once, rays), b = closest(embree, rays);
  size_t different = 0;
  for (size_t i = 0; i < rays.size(); ++i)
    different += a[i].valid() != b[i].valid() || (a[i].valid() && std::abs(a[i].t - b[i].t) > 1e-3f * b[i].t);
  EXPECT_LE(different, 6u); // movers that are flat have a thickness in Embree
}

TEST(MovingInstances, GiveTheSameTreeForAnyNumberOfThreads) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const BakedScene baked(room_of(3000));
  const Movers movers = movers_from(kStill, baked.source, kRoom);
  std::vector<std::vector<RayHit>> results;
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{5}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    PackedTracer tracer(baked.file, baked.source, chosen_isa(), movers);
    RandomMotion motion(9);
    std::vector<Affine> places;
    for (size_t i = 0; i < movers.instances.size(); ++i) places.push_back(motion.next());
    tracer.place_instances(movers.instances, places);
    const std::vector<Ray> rays = random_rays(test::fewer(5000u), {{-9, -1, -9}, {9, 7, 9}}, tracer.space());
    packed::KernelCounters counters;
    std::vector<RayHit> hits(rays.size());
    tracer.count_closest(rays, kCameraRays, hits, counters);
    results.push_back(hits);
    EXPECT_EQ(std::memcmp(results[0].data(), hits.data(), hits.size() * sizeof(RayHit)), 0);
  }
}

TEST(MovingInstances, AreRejectedWhereTheyCannotMove) {
  const BakedScene baked(room_of(4));
  const Movers movers = movers_from(kStill + 1, baked.source, kRoom);
  PackedTracer packed(baked.file, baked.source, chosen_isa(), movers);
  EmbreeTracer embree(baked.source, {}, movers);
  const Affine place(placed({1, 2, 3}));
  const Affine far(placed({1e4, 2, 3})), wrong(placed({std::nan(""), 2, 3}));
  using Numbers = std::vector<uint32_t>;
  using Places = std::vector<Affine>;
  for (RayTracer* tracer : {static_cast<RayTracer*>(&packed), static_cast<RayTracer*>(&embree)}) {
    const std::vector<Affine> before(tracer->world_from_object().begin(), tracer->world_from_object().end());
    EXPECT_THROW(tracer->place_instances(Numbers{0}, Places{place}), Error);      // world space
    EXPECT_THROW(tracer->place_instances(Numbers{kStill}, Places{place}), Error); // not a mover
    EXPECT_THROW(tracer->place_instances(Numbers{99}, Places{place}), Error);     // no instance
    EXPECT_THROW(tracer->place_instances(Numbers{4, 3}, Places{place, place}), Error);
    EXPECT_THROW(tracer->place_instances(Numbers{3, 3}, Places{place, place}), Error);
    EXPECT_THROW(tracer->place_instances(Numbers{3}, Places{}), Error);
    EXPECT_THROW(tracer->place_instances(Numbers{3, 4}, Places{place, far}), Error);
    EXPECT_THROW(tracer->place_instances(Numbers{3, 4}, Places{place, wrong}), Error);
    EXPECT_TRUE(std::ranges::equal(tracer->world_from_object(), before)) << "a rejected call moves nothing";
    tracer->place_instances({}, {});
    tracer->place_instances(Numbers{3}, Places{place});
    EXPECT_EQ(tracer->world_from_object()[3], place);
  }
  EXPECT_THROW(PackedTracer(baked.file, baked.source, chosen_isa(), {{0}, kRoom}), Error); // in the tree of the world
  EXPECT_THROW(PackedTracer(baked.file, baked.source, chosen_isa(), {{99}, kRoom}), Error);
  EXPECT_THROW(EmbreeTracer(baked.source, {}, {{3, 2}, kRoom}), Error);
  PackedTracer still(baked.file, baked.source);
  EXPECT_THROW(still.place_instances(Numbers{3}, Places{place}), Error);
}

} // namespace
} // namespace packtrace
