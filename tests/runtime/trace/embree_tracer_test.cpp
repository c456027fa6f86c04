#include "runtime/trace/embree/embree_tracer.h"

#include <numbers>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;

/// A sphere that only camera rays hit (kNoShadow), one that only occlusion rays hit (kInvisible), and two instances of
/// a box.
Scene two_classes() {
  Scene scene;
  add_shape(scene, test::sphere({-2, 0, 0}, 1, 24), kNoShadow);
  add_shape(scene, test::sphere({2, 0, 0}, 1, 24), kInvisible);
  add_object(scene, test::box({-1, -1, -1}, {1, 1, 1}));
  scene.instances.push_back({0, Affine(test::placed({0, 3, 0}, {1, 0.5, 2}, 30))});
  scene.instances.push_back({0, Affine(test::placed({0, -3, 0}, {-1, 1, 1}, 10))});
  return scene;
}

/// Rays from a point in front of the scene, or inside it for every third ray, through a square around it.
std::vector<Ray> fan(const UnitSpace& space, uint32_t side) {
  std::vector<Ray> rays;
  for (uint32_t i = 0; i < side * side; ++i) {
    const double x = -4.0 + 8.0 * (i % side) / side, y = -5.0 + 10.0 * (i / side) / side;
    const Vec3 eye(space.to_unit(DVec3(0, 0.1, i % 3 == 0 ? -1.5 : -9)));
    const Vec3 target(space.to_unit(DVec3(x, y, 0)));
    rays.push_back({eye, 0.0f, glm::normalize(target - eye)});
  }
  return rays;
}

TEST(EmbreeTracer, OrderOfRaysChangesNoHit) {
  const Scene scene = two_classes();
  const FloatSource source(scene);
  const EmbreeTracer tracer(source, {});
  const std::vector<Ray> rays = fan(tracer.space(), 45); // more rays than a stream holds, and not a multiple of 16
  for (const uint32_t ray_class : {kCameraRays, kOcclusionRays}) {
    std::vector<RayHit> coherent(rays.size()), incoherent(rays.size());
    std::vector<uint8_t> any_coherent(rays.size()), any_incoherent(rays.size());
    tracer.closest_hits(rays, ray_class, RayOrder::kCoherent, coherent);
    tracer.closest_hits(rays, ray_class, RayOrder::kIncoherent, incoherent);
    tracer.any_hits(rays, ray_class, RayOrder::kCoherent, any_coherent);
    tracer.any_hits(rays, ray_class, RayOrder::kIncoherent, any_incoherent);
    uint32_t hits = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(coherent[i].valid(), incoherent[i].valid()) << i;
      ASSERT_EQ(any_coherent[i], coherent[i].valid()) << i;
      ASSERT_EQ(any_incoherent[i], coherent[i].valid()) << i;
      if (!coherent[i].valid()) continue;
      ++hits;
      ASSERT_NEAR(coherent[i].t, incoherent[i].t, 1e-5f * coherent[i].t) << i;
    }
    EXPECT_GT(hits, rays.size() / 10);
    EXPECT_LT(hits, rays.size() * 9 / 10);
  }
}

TEST(EmbreeTracer, HitsResolveToWhatLiesThere) {
  const Scene scene = two_classes();
  const FloatSource source(scene);
  const EmbreeTracer tracer(source, {});
  const std::vector<Ray> rays = fan(tracer.space(), 40);
  std::vector<RayHit> hits(rays.size());
  for (const uint32_t ray_class : {kCameraRays, kOcclusionRays}) {
    std::vector<uint32_t> by_instance(source.instances().size());
    tracer.closest_hits(rays, ray_class, RayOrder::kCoherent, hits);
    for (size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i].valid()) continue;
      const HitSurface surface = tracer.resolve(hits[i]);
      const DAffine& placed = surface.placement->unit_from_surface;
      const DVec3 v0 = transform_point(placed, DVec3(surface.vertices[0]));
      const DVec3 e1 = transform_point(placed, DVec3(surface.vertices[1])) - v0;
      const DVec3 e2 = transform_point(placed, DVec3(surface.vertices[2])) - v0;
      const DVec3 on_surface = v0 + e1 * double(hits[i].u) + e2 * double(hits[i].v);
      const DVec3 on_ray = DVec3(rays[i].origin) + DVec3(rays[i].direction) * double(hits[i].t);
      ASSERT_LT(glm::distance(on_surface, on_ray), 1e-5 * UnitSpace::kHalfSize) << i;
      ++by_instance[surface.placement->instance];
    }
    EXPECT_EQ(by_instance[0] > 0, ray_class == kCameraRays);
    EXPECT_EQ(by_instance[1] > 0, ray_class == kOcclusionRays);
    EXPECT_GT(by_instance[2], 0u);
    EXPECT_GT(by_instance[3], 0u);
  }
}

TEST(EmbreeTracer, RaysWithoutLengthHitNothing) {
  const Scene scene = two_classes();
  const FloatSource source(scene);
  const EmbreeTracer tracer(source, {});
  std::vector<Ray> rays = fan(tracer.space(), 40);
  std::vector<RayHit> whole(rays.size()), gaps(rays.size());
  std::vector<uint8_t> occluded(rays.size());
  tracer.closest_hits(rays, kCameraRays, RayOrder::kCoherent, whole);
  for (size_t i = 0; i < rays.size(); i += 3) rays[i].tfar = -1.0f;
  for (const RayOrder order : {RayOrder::kCoherent, RayOrder::kIncoherent}) {
    tracer.closest_hits(rays, kCameraRays, order, gaps);
    tracer.any_hits(rays, kCameraRays, order, occluded);
    for (size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(gaps[i].valid(), i % 3 != 0 && whole[i].valid()) << i;
      ASSERT_EQ(occluded[i], gaps[i].valid()) << i;
    }
  }
}

TEST(EmbreeTracer, RaysEndAtTfar) {
  Scene scene;
  add_shape(scene, test::quad({-1, -1, 2}, {2, 0, 0}, {0, 2, 0}));
  const FloatSource source(scene);
  const EmbreeTracer tracer(source, {});
  const Vec3 eye(tracer.space().to_unit(DVec3(0, 0, 0)));
  const auto distance = static_cast<float>(2.0 * tracer.space().scale());
  const std::vector<Ray> rays = {{eye, 0.0f, {0, 0, 1}, 0.999f * distance},
                                 {eye, 0.0f, {0, 0, 1}, 1.001f * distance},
                                 {eye, 1.001f * distance, {0, 0, 1}}};
  for (const RayOrder order : {RayOrder::kCoherent, RayOrder::kIncoherent}) {
    std::vector<uint8_t> occluded(3);
    tracer.any_hits(rays, kOcclusionRays, order, occluded);
    EXPECT_EQ(occluded, (std::vector<uint8_t>{0, 1, 0}));
  }
}

TEST(EmbreeTracer, CompactTreesAreSmallerAndHitTheSame) {
  Scene scene;
  add_shape(scene, test::sphere({0, 0, 0}, 1, 60));
  const FloatSource source(scene);
  const EmbreeTracer usual(source, {}), compact(source, {BvhQuality::kMedium, true, true});
  EXPECT_LT(compact.resident().front().bytes, usual.resident().front().bytes);
  const std::vector<Ray> rays = fan(usual.space(), 30);
  std::vector<RayHit> a(rays.size()), b(rays.size());
  usual.closest_hits(rays, kCameraRays, RayOrder::kIncoherent, a);
  compact.closest_hits(rays, kCameraRays, RayOrder::kIncoherent, b);
  for (size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(a[i].valid(), b[i].valid()) << i;
}

TEST(MakeTracer, KnowsEmbree) {
  Scene scene;
  add_shape(scene, test::sphere({0, 0, 0}, 1, 8));
  const FloatSource source(scene);
  const std::unique_ptr<RayTracer> tracer = make_tracer(source, nullptr, {});
  EXPECT_EQ(tracer->name(), "embree");
  EXPECT_FALSE(tracer->isa().empty());
  uint64_t sum = 0;
  for (const ResidentPart& part : tracer->resident()) sum += part.bytes;
  EXPECT_EQ(resident_bytes(*tracer), sum);
}

TEST(MakeTracer, BackendPackedNeedsAPackedFile) {
  Scene scene;
  add_shape(scene, test::sphere({0, 0, 0}, 1, 8));
  const FloatSource source(scene);
  try {
    make_tracer(source, nullptr, {Backend::kPacked, {}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
  }
}

} // namespace
} // namespace packtrace
