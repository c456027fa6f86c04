#include "runtime/camera/primary_visibility.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::camera_at;
using test::quad;

GBuffer trace(const Scene& scene, const PrimaryCamera& now, const PrimaryCamera& previous, EmbreeConfig config = {}) {
  const FloatSource source(scene);
  const EmbreeTracer embree(source, config);
  Progress progress;
  GBuffer gbuffer;
  trace_primary(source, embree, now, previous, gbuffer, progress);
  return gbuffer;
}

GBuffer trace(const Scene& scene, const Camera& camera, ImageSize size, EmbreeConfig config = {}) {
  const PrimaryCamera primary(camera, size);
  return trace(scene, primary, primary, config);
}

template <typename Array>
  requires requires(const Array& array) { array.data(); }
bool same_bytes(const Array& a, const Array& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(*a.data())) == 0;
}

bool same_bytes(const GBuffer& a, const GBuffer& b) {
  return a.size == b.size && same_bytes(a.view_z, b.view_z) && same_bytes(a.position, b.position) &&
         same_bytes(a.geometric_normal, b.geometric_normal) && same_bytes(a.normal, b.normal) &&
         same_bytes(a.albedo, b.albedo) && same_bytes(a.instance, b.instance) && same_bytes(a.material, b.material) &&
         same_bytes(a.offset, b.offset) && same_bytes(a.motion_px, b.motion_px);
}

/// A wall at z = 5 facing the camera at the origin.
Scene wall_scene(MaterialFlags flags = 0, float half = 100) {
  Scene scene;
  add_shape(scene, quad({-half, -half, 5}, {2 * half, 0, 0}, {0, 2 * half, 0}), flags);
  return scene;
}

TEST(PrimaryVisibility, FillsEveryFieldOfAHit) {
  Scene scene = wall_scene();
  scene.materials[0].albedo = Vec3(0.1f, 0.2f, 0.3f);
  const GBuffer g = trace(scene, camera_at({0, 0, 0}, {0, 0, 1}, 90), {37, 21});
  const PrimaryCamera camera(camera_at({0, 0, 0}, {0, 0, 1}, 90), {37, 21});
  for (uint32_t y = 0; y < 21; ++y)
    for (uint32_t x = 0; x < 37; ++x) {
      const size_t i = y * 37 + x;
      const DVec3 d = camera.ray(x, y).direction;
      EXPECT_FLOAT_EQ(g.view_z[i], 5.0f);
      EXPECT_NEAR(glm::distance(DVec3(g.position[i]), d * (5.0 / d.z)), 0.0, 2e-6);
      EXPECT_EQ(g.position[i].z, 5.0f);
      EXPECT_EQ(g.geometric_normal[i], Vec3(0, 0, -1));
      EXPECT_EQ(g.normal[i], Vec3(0, 0, -1));
      EXPECT_EQ(g.albedo[i], Vec3(0.1f, 0.2f, 0.3f));
      EXPECT_EQ(g.instance[i], 0u);
      EXPECT_EQ(g.motion_px[i], Vec2(0));
      EXPECT_GT(g.offset[i], 0.0f);
      EXPECT_LT(g.offset[i], 1e-4f);
    }
}

TEST(PrimaryVisibility, MissesAreClean) {
  Scene scene = wall_scene();
  GBuffer g = trace(scene, camera_at({0, 0, 0}, {0, 0, 1}), {8, 8});
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  const PrimaryCamera away(camera_at({0, 0, 0}, {0, 0, -1}), {8, 8});
  Progress progress;
  trace_primary(source, embree, away, away, g, progress); // overwrites the previous contents
  GBuffer empty;
  empty.resize({8, 8});
  EXPECT_TRUE(same_bytes(g, empty));
}

TEST(PrimaryVisibility, APixelTracedAloneHitsTheSame) {
  Scene scene = wall_scene(0, 3);
  add_shape(scene, test::sphere(Vec3(0, 0, 3), 1.0f, 24));
  const PrimaryCamera camera(camera_at({0, 0, 0}, {0, 0, 1}, 90), {77, 45}); // tiles are cut off
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  GBuffer g;
  Progress progress;
  trace_primary(source, embree, camera, camera, g, progress);
  uint32_t misses = 0;
  for (uint32_t y = 0; y < 45; ++y)
    for (uint32_t x = 0; x < 77; ++x) {
      const size_t at = size_t{y} * 77 + x;
      const std::optional<CameraHit> hit = trace_pixel(source, embree, camera, x, y);
      ASSERT_EQ(hit.has_value(), g.instance[at] != kNoInstance) << x << ' ' << y;
      misses += hit ? 0 : 1;
      if (!hit) continue;
      EXPECT_EQ(hit->position, g.position[at]);
      EXPECT_EQ(hit->instance, g.instance[at]);
      EXPECT_EQ(hit->triangle, g.triangle[at]);
      EXPECT_EQ(hit->material, g.material[at]);
      EXPECT_EQ(hit->back_face, g.back_face[at] != 0);
    }
  EXPECT_GT(misses, 100u);
  EXPECT_LT(misses, 77u * 45u - 100u);
}

TEST(PrimaryVisibility, ChannelsThatAreNotKeptTakeNoMemory) {
  const Scene scene = wall_scene();
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  const PrimaryCamera camera(camera_at({0, 0, 0}, {0, 0, 1}, 90), {37, 21});
  Progress progress;
  GBuffer all, g;
  trace_primary(source, embree, camera, camera, all, progress);
  for (const uint32_t kept : {uint32_t{kAllChannels}, uint32_t{kMaterialChannel}, 0u, uint32_t{kAllChannels}}) {
    g.keep_channels(kept);
    trace_primary(source, embree, camera, camera, g, progress);
    EXPECT_EQ(g.albedo.capacity() != 0, (kept & kAlbedoChannel) != 0);
    EXPECT_EQ(g.triangle.capacity() != 0, (kept & kTriangleChannel) != 0);
    EXPECT_EQ(g.material.capacity() != 0, (kept & kMaterialChannel) != 0);
    EXPECT_EQ(g.back_face.capacity() != 0, (kept & kBackFaceChannel) != 0);
    EXPECT_EQ(same_bytes(g, all), kept == kAllChannels);
    EXPECT_TRUE(same_bytes(g.position, all.position));
  }
}

TEST(PrimaryVisibility, EmptyScenesMissEverywhere) {
  GBuffer empty;
  empty.resize({5, 3});
  EXPECT_TRUE(same_bytes(trace(Scene{}, camera_at({0, 0, 0}, {0, 0, 1}), {5, 3}), empty));
  Scene no_triangles;
  add_shape(no_triangles, Mesh{});
  EXPECT_TRUE(same_bytes(trace(no_triangles, camera_at({0, 0, 0}, {0, 0, 1}), {5, 3}), empty));
}

TEST(PrimaryVisibility, CamerasFarAwaySeeWhatTheyPointAt) {
  Camera camera = camera_at({0, 0, -3e19}, {0, 0, 0}, 90);
  const GBuffer wide = trace(wall_scene(), camera, {8, 8});
  ASSERT_EQ(wide.instance.size(), 64u);
  for (const uint32_t instance : wide.instance)
    EXPECT_EQ(instance, kNoInstance) << "the wall is far smaller than a pixel";
  camera.projection = Projection::kOrthographic;
  const GBuffer g = trace(wall_scene(), camera, {8, 8});
  for (size_t i = 0; i < g.instance.size(); ++i) {
    EXPECT_EQ(g.instance[i], 0u);
    EXPECT_NEAR(g.position[i].z, 5.0f, 1e-3f);
    EXPECT_LE(std::abs(g.position[i].x), 1.0f);
  }
}

TEST(PrimaryVisibility, RightOfTheViewerIsRightInTheImage) {
  Scene scene;
  add_shape(scene, quad({10, -100, -200}, {0, 0, 200}, {0, 200, 0})); // x = 10, z < 0: right when looking along +x
  const GBuffer g = trace(scene, camera_at({0, 0, 0}, {1, 0, 0}, 90), {8, 8});
  for (uint32_t y = 0; y < 8; ++y)
    for (uint32_t x = 0; x < 8; ++x) EXPECT_EQ(g.instance[y * 8 + x] != kNoInstance, x >= 4) << x << "," << y;
}

TEST(PrimaryVisibility, CameraRaysPassInvisibleSurfacesOnly) {
  const Camera camera = camera_at({0, 0, 0}, {0, 0, 1});
  const auto hits = [&](MaterialFlags flags) {
    return trace(wall_scene(flags), camera, {4, 4}).instance[5] != kNoInstance;
  };
  EXPECT_TRUE(hits(0));
  EXPECT_TRUE(hits(kTransmissive));
  EXPECT_TRUE(hits(kNoShadow));
  EXPECT_FALSE(hits(kInvisible));
  EXPECT_FALSE(hits(kAbsent));
}

TEST(PrimaryVisibility, AlphaMaskLetsCameraRaysThroughAndShadowMaskDoesNot) {
  Scene scene = wall_scene(kAlphaMask, 6);
  scene.masks.push_back({64, 1, WrapMode::kClamp, Vec2(1), Vec2(0), {0u, ~0u}}); // The left half is absent.
  const Camera camera = camera_at({0, 0, 0}, {0, 0, 1}, 90);
  scene.materials[0].alpha_mask = 0;
  GBuffer g = trace(scene, camera, {8, 8});
  for (uint32_t x = 0; x < 8; ++x) EXPECT_EQ(g.instance[24 + x] != kNoInstance, x >= 4) << x;
  scene.materials[0].flags = kShadowAlphaMask;
  scene.materials[0].alpha_mask = kNoMask;
  scene.materials[0].shadow_alpha_mask = 0;
  g = trace(scene, camera, {8, 8});
  for (uint32_t x = 0; x < 8; ++x) EXPECT_NE(g.instance[24 + x], kNoInstance);
}

TEST(PrimaryVisibility, InstancesMatchBakedGeometry) {
  const Mesh mesh = test::sphere({0.5f, 0, 0}, 1, 24);
  for (const DVec3 scale : {DVec3(1), DVec3(-1, 1, 1), DVec3(0.2, 3, 1), DVec3(-2, -0.5, -3)}) {
    const DAffine place = test::placed({1, 2, 3}, scale, 33, {1, 2, 1});
    Scene baked, instanced;
    add_shape(baked, mesh, 0, place);
    add_object(instanced, mesh);
    instanced.instances.push_back({0, Affine(place)});
    const Camera camera = camera_at({1, 2, -9}, {1, 2, 3}, 50);
    const GBuffer a = trace(baked, camera, {64, 64}), b = trace(instanced, camera, {64, 64});
    uint32_t different = 0, hits = 0;
    for (size_t i = 0; i < a.view_z.size(); ++i) {
      if (a.instance[i] != b.instance[i]) {
        ++different;
        continue;
      }
      if (a.instance[i] == kNoInstance) continue;
      ++hits;
      EXPECT_NEAR(a.view_z[i], b.view_z[i], 2e-4);
      EXPECT_GT(glm::dot(a.normal[i], b.normal[i]), 0.999f);
      EXPECT_LT(glm::dot(DVec3(b.geometric_normal[i]), DVec3(b.position[i]) - DVec3(1, 2, -9)), 0.0);
      EXPECT_GE(glm::dot(b.normal[i], b.geometric_normal[i]), 0.0f);
    }
    EXPECT_GE(hits, 100u);
    EXPECT_LE(different, 2u); // at the silhouette
  }
}

TEST(PrimaryVisibility, FlatteningInstancesAreTraced) {
  Scene scene;
  add_object(scene, test::box({-1, -1, -1}, {1, 1, 1}));
  scene.instances.push_back({0, Affine(test::placed({0, 0, 5}, {1, 1, 0}))});
  const GBuffer g = trace(scene, camera_at({0, 0, 0}, {0, 0, 1}, 20), {8, 8});
  for (size_t i = 0; i < g.view_z.size(); ++i) {
    ASSERT_EQ(g.instance[i], 0u);
    EXPECT_EQ(g.view_z[i], 5.0f);
    EXPECT_EQ(g.geometric_normal[i], Vec3(0, 0, -1));
  }
}

TEST(PrimaryVisibility, FiftyThousandInstancesKeepTheirNumbers) {
  Scene scene;
  add_object(scene, test::box({-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}));
  constexpr uint32_t kSide = 224;
  for (uint32_t i = 0; i < kSide * kSide; ++i)
    scene.instances.push_back({0, Affine(test::placed(DVec3(i % kSide, i / kSide, 0)))});
  Camera camera;
  camera.projection = Projection::kOrthographic;
  // Flipped, so that y grows with the index: pixel i shows instance i.
  camera.screen_window = glm::dvec4(-0.5, kSide - 0.5, kSide - 0.5, -0.5);
  camera.width_px = camera.height_px = kSide;
  camera.world_from_camera[3] = DVec3(0, 0, -10);
  const GBuffer g = trace(scene, camera, {kSide, kSide});
  for (uint32_t i = 0; i < kSide * kSide; ++i) ASSERT_EQ(g.instance[i], i);
}

TEST(PrimaryVisibility, MotionLeadsToThePreviousPlace) {
  const Scene scene = wall_scene();
  const ImageSize size{40, 20};
  const PrimaryCamera previous(camera_at({0, 0, 0}, {0, 0, 1}, 90), size);
  // Half a unit to the right; the wall is at depth 5.
  const PrimaryCamera now(camera_at({0.5, 0, 0}, {0.5, 0, 1}, 90), size);
  const GBuffer g = trace(scene, now, previous);
  // The image shows 10 units of the wall in 20 pixels; the point at the centre of a pixel was one pixel farther right
  // in the previous image.
  ASSERT_EQ(g.motion_px.size(), size.pixels());
  for (const Vec2 motion : g.motion_px) {
    EXPECT_NEAR(motion.x, -1.0f, 1e-4f);
    EXPECT_NEAR(motion.y, 0.0f, 1e-4f);
  }
}

TEST(PrimaryVisibility, MotionOfPointsBehindThePreviousCameraLeavesTheImage) {
  const ImageSize size{8, 8};
  const PrimaryCamera previous(camera_at({0, 0, 9}, {0, 0, 10}), size), now(camera_at({0, 0, 0}, {0, 0, 1}), size);
  const GBuffer g = trace(wall_scene(), now, previous);
  ASSERT_EQ(g.motion_px.size(), size.pixels());
  for (const Vec2 motion : g.motion_px) EXPECT_EQ(motion, Vec2(kNoMotionPx));
}

TEST(PrimaryVisibility, SubPixelOffsetMovesTheSamples) {
  const ImageSize size{8, 8};
  const Camera camera = camera_at({0, 0, 0}, {0, 0, 1}, 90);
  const PrimaryCamera plain(camera, size), shifted(camera, size, {0.25, 0.5});
  const GBuffer g = trace(wall_scene(), shifted, plain);
  EXPECT_NEAR(g.motion_px[9].x, -0.25f, 1e-4f); // The point is a quarter pixel farther right in the unshifted image.
  EXPECT_NEAR(g.motion_px[9].y, -0.5f, 1e-4f);
}

TEST(PrimaryVisibility, SameBytesForAnyThreadCountAndBuild) {
  Scene scene = wall_scene();
  add_shape(scene, test::sphere({0, 0, 3}, 1, 64));
  add_object(scene, test::sphere({0, 0, 0}, 0.3f, 32));
  for (int i = 0; i < 50; ++i) scene.instances.push_back({0, Affine(test::placed({i * 0.1 - 2.5, i % 7 * 0.2, 2}))});
  const Camera camera = camera_at({0.1, 0.3, -2}, {0, 0, 3});
  const GBuffer reference = trace(scene, camera, {200, 120});
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{5}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_TRUE(same_bytes(reference, trace(scene, camera, {200, 120})));
  }
}

TEST(PrimaryVisibility, PassesOnWhatTheProgressObserverThrows) {
  const Scene scene = wall_scene();
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  const PrimaryCamera camera(camera_at({0, 0, 0}, {0, 0, 1}), {256, 256});
  Progress progress([](std::string_view, uint64_t done, uint64_t total) {
    EXPECT_EQ(total, 65536u);
    if (done > 0) throw Error(ErrorKind::kCancelled, "cancelled");
  });
  GBuffer gbuffer;
  EXPECT_THROW(trace_primary(source, embree, camera, camera, gbuffer, progress), Error);
}

TEST(PrimaryVisibility, PositionsOnHugeTrianglesStayOnTheirPixel) {
  Scene scene;
  add_shape(scene, quad({-1e6f, -1, -1e6f}, {0, 0, 2e6f}, {2e6f, 0, 0}));
  const PrimaryCamera camera(camera_at({0, 0, 0}, {0, -0.5, 1}, 40), {32, 32});
  const GBuffer g = trace(scene, camera, camera);
  for (uint32_t i = 0; i < 32 * 32; ++i) {
    ASSERT_EQ(g.position[i].y, -1.0f);
    const auto back = camera.project(DVec3(g.position[i]));
    ASSERT_TRUE(back.has_value());
    EXPECT_NEAR(back->pixel.x, i % 32 + 0.5, 1e-4);
    EXPECT_NEAR(back->pixel.y, i / 32 + 0.5, 1e-4);
  }
}

TEST(EmbreeTracer, RejectsPositionsThatLeaveTheFloatRange) {
  Scene scene;
  add_shape(scene, quad({0, 0, 0}, {1e30f, 0, 0}, {0, 1e30f, 0}), 0, test::placed({0, 0, 0}, DVec3(1e20)));
  const FloatSource source(scene);
  EXPECT_THROW(EmbreeTracer(source, {}), Error);
}

TEST(EmbreeTracer, RejectsTransformsThatAreNotFinite) {
  Scene scene;
  add_object(scene, quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  scene.instances.push_back({0, Affine(1.0f)});
  scene.instances[0].world_from_object[1][2] = NAN;
  const FloatSource source(scene);
  EXPECT_THROW(EmbreeTracer(source, {}), Error);
}

TEST(EmbreeTracer, CountsItsBytes) {
  Scene scene;
  add_shape(scene, test::sphere({0, 0, 0}, 1, 100));
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  const uint64_t triangles = source.counts(0).triangles;
  const std::vector<ResidentPart> parts = embree.resident();
  ASSERT_EQ(parts.front().name, "bvh");
  EXPECT_GT(parts.front().bytes, 20 * triangles);
  EXPECT_GT(resident_bytes(embree), parts.front().bytes + 18 * triangles);
  EXPECT_LT(resident_bytes(embree), 400 * triangles);
}

TEST(PrimaryVisibility, NothingIsSeenThroughAClosedMesh) {
  Scene scene; // small triangles far from the camera, where float arithmetic is coarse
  add_shape(scene, test::sphere({0, 0, 0}, 1, 150));
  add_shape(scene, quad({-100, -90, -100}, {200, 0, 0}, {0, 0, 200}));
  const Vec3 eye(60, 10, -20);
  const GBuffer g = trace(scene, camera_at(DVec3(eye), {0, 0, 0}, 1.2), {700, 700});
  size_t hits = 0, behind = 0;
  for (size_t i = 0; i < g.instance.size(); ++i) {
    hits += g.instance[i] == 0;
    behind += g.instance[i] != 0 || glm::dot(g.position[i], glm::normalize(eye)) < 0.0f;
  }
  EXPECT_GT(hits, 400000u); // The sphere fills most of the image.
  EXPECT_EQ(behind, 0u);
}

TEST(PrimaryVisibility, TexturesAreLookedUpWhereTheRayHits) {
  Scene scene = wall_scene(kAlbedoTexture, 5);
  scene.meshes[0].uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  scene.textures.push_back({"halves", 2, 1, WrapMode::kClamp, Vec2(1), Vec2(0), {255, 0, 0, 0, 0, 255}});
  scene.materials[0].albedo_texture = 0;
  const GBuffer g = trace(scene, camera_at({0, 0, 0}, {0, 0, 1}, 90.0), {64, 64}); // shows the wall from edge to edge
  const size_t row = 32 * 64;
  EXPECT_EQ(g.albedo[row + 2], Vec3(1, 0, 0));
  EXPECT_EQ(g.albedo[row + 61], Vec3(0, 0, 1));
  EXPECT_NEAR(g.albedo[row + 31].x, 0.5f, 0.05f);
  EXPECT_NEAR(g.albedo[row + 31].x + g.albedo[row + 31].z, 1.0f, 1e-5f); // a blend in linear light
}

} // namespace
} // namespace packtrace
