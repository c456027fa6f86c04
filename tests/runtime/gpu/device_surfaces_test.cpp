// The device makes the G-buffer of the CPU from its hits, bit for bit.

#include "runtime/camera/device_surfaces.h"

#include <gtest/gtest.h>

#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/lod_view.h"
#include "runtime/gpu/device_view.h"
#include "runtime/lod/lod_sharing.h"
#include "runtime/trace/gpu/gpu_tracer.h"
#include "runtime/trace/source/lod_source.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/gpu/same_surfaces.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::placed;

constexpr ImageSize kView{77, 45};

class DeviceSurfacesTest : public test::OnGpu {
protected:
  /// Compares the surfaces that the device makes with those of the packed tracer. Returns the latter.
  GBuffer expect_same(const SceneSource& source, const GpuTracer& tracer, const PrimaryCamera& camera) const {
    GBuffer expected, gbuffer;
    gbuffer.keep_channels(0);
    Progress progress;
    const PrimaryCamera before(test::camera_at({0.2, 3.1, -12}, {0, 1, 0}), kView);
    trace_primary(source, tracer.packed(), camera, before, expected, progress);
    trace_primary(source, tracer, camera, before, gbuffer, progress);
    EXPECT_TRUE(gbuffer.on_gpu && gbuffer.on_gpu->has_surfaces());
    test::expect_same_surfaces(gbuffer, expected);
    for (const std::string& message : tracer.scene().validation_messages()) ADD_FAILURE() << message;
    return expected;
  }

  const PrimaryCamera camera_{test::camera_at({0.1, 3, -12}, {0, 1, 0}), kView};
};

size_t smooth_pixels(const GBuffer& g) {
  size_t count = 0;
  for (size_t i = 0; i < g.normal.size(); ++i) count += g.normal[i] != g.geometric_normal[i] ? 1 : 0;
  return count;
}

/// A square whose vertices have one of three normals each.
Mesh three_normals() {
  Mesh mesh;
  mesh.name = "square";
  constexpr uint32_t kVertices = 9;
  const Vec3 normals[] = {glm::normalize(Vec3(0.3f, 1, 0.2f)), glm::normalize(Vec3(-0.4f, 1, 0)), Vec3(0, 1, 0)};
  for (uint32_t i = 0; i < kVertices * kVertices; ++i) {
    mesh.positions.push_back(Vec3(static_cast<float>(i % kVertices) - 4, 0, static_cast<float>(i / kVertices) - 4));
    mesh.normals.push_back(normals[i % 3]);
  }
  for (uint32_t y = 0; y + 1 < kVertices; ++y)
    for (uint32_t x = 0; x + 1 < kVertices; ++x) {
      const uint32_t a = y * kVertices + x;
      mesh.triangles.push_back({a, a + kVertices, a + 1});
      mesh.triangles.push_back({a + 1, a + kVertices, a + kVertices + 1});
    }
  return mesh;
}

/// Spheres in the tree of the world and as mirrored, squeezed instances; faces on all charts, and a palette.
TEST_F(DeviceSurfacesTest, NormalsOfAllFamilies) {
  Scene scene;
  add_shape(scene, test::sphere({-3, 1, 0}, 2, 12));
  add_shape(scene, three_normals());
  add_object(scene, test::sphere({0, 0, 0}, 1, 5)); // clusters with normals on several charts
  scene.instances.push_back({0, Affine(placed({1, 2, 0}, {-1.5, 1, 2}, 35))});
  scene.instances.push_back({0, Affine(placed({4, 2, 1}, DVec3(2), 80, {1, 1, 0}))});
  bool palette = false, mixed = false, unfolded = false;
  // Each file needs its own pipelines, whose compilation takes longest, so not all encodings are tested.
  for (const NormalEncoding encoding :
       {NormalEncoding::kZsign32, NormalEncoding::kAxis24, NormalEncoding::kOct24, NormalEncoding::kAxis12}) {
    SCOPED_TRACE(format_of(encoding).name);
    BakeConfig config;
    config.normals = encoding;
    config.keep_normals = true;
    const test::BakedScene baked(scene, config);
    for (uint32_t g = 0; g < baked.file.geometries().size(); ++g)
      for (const baked::ClusterRecord& cluster : baked.file.clusters(g)) {
        palette |= cluster.normal_palette != 0;
        mixed |= (cluster.flags & baked::kClusterMixedCharts) != 0;
        unfolded |= cluster.normal_anchor[0] < 0 || cluster.normal_anchor[1] < 0;
      }
    const GpuTracer tracer(baked.file, baked.source, config_);
    EXPECT_GT(smooth_pixels(expect_same(baked.source, tracer, camera_)), 400u);
  }
  EXPECT_TRUE(palette && mixed && unfolded) << palette << mixed << unfolded;
}

/// Coordinates of more than 57 bits a vertex, which kernels read from a buffer of floats.
TEST_F(DeviceSurfacesTest, WideCoordinates) {
  Scene scene;
  add_shape(scene, test::sphere({0, 1, 0}, 3, 12));
  BakeConfig config;
  config.precision_kind = PrecisionKind::kPositionBits;
  config.precision = 30;
  const test::BakedScene baked(scene, config);
  const GpuTracer tracer(baked.file, baked.source, config_);
  EXPECT_GT(smooth_pixels(expect_same(baked.source, tracer, camera_)), 250u);
}

/// Instances that were placed elsewhere since the last picture.
TEST_F(DeviceSurfacesTest, PlacedInstances) {
  const test::BakedScene baked(test::thicket_scene());
  Movers movers;
  movers.instances = {static_cast<uint32_t>(baked.source.instances().size()) - 1};
  movers.world.extend(DVec3(-20)), movers.world.extend(DVec3(20));
  GpuTracer tracer(baked.file, baked.source, config_, movers);
  expect_same(baked.source, tracer, camera_);
  const Affine place(placed({0, 3, -4}, DVec3(2), 30));
  tracer.place_instances(movers.instances, {&place, 1});
  const GBuffer g = expect_same(baked.source, tracer, camera_);
  EXPECT_GT(std::ranges::count(g.instance, movers.instances[0]), 100);
}

TEST_F(DeviceSurfacesTest, LevelsOfDetail) {
  Scene scene;
  add_shape(scene, test::sphere({-2, 1, 0}, 1, 8));
  add_object(scene, test::sphere({0, 0, 0}, 2, 40));
  for (const double z : {0.0, 6.0}) scene.instances.push_back({0, Affine(placed({2, 1, z}))});
  BakeConfig config;
  config.lod = LodUse::kAll;
  const test::BakedScene baked(scene, config);
  const std::vector<LodGeometry> geometries = lod_geometries(baked.file);
  const std::vector<LodInstance> instances = lod_instances(baked.source);
  LodSharing sharing(geometries, instances, {});
  const LodPlan plan = sharing.plan(detail_view(camera_, baked.file.world_bounds(), 2.0));
  const LodSource source(baked.file, baked.source, sharing, plan);
  const GpuTracer tracer(baked.file, source, config_);
  EXPECT_GT(smooth_pixels(expect_same(source, tracer, camera_)), 120u);
}

/// Extreme scales: devices may flush denormal floats, so the CPU makes the surfaces.
TEST_F(DeviceSurfacesTest, TinyScenesAreLeftToTheCpu) {
  Scene scene;
  add_shape(scene, test::sphere({0, 0, 0}, 1e-30f, 12));
  const test::BakedScene baked(scene);
  const GpuTracer tracer(baked.file, baked.source, config_);
  GBuffer g;
  g.keep_channels(0);
  Progress progress;
  const PrimaryCamera camera(test::camera_at({0, 0, -4e-30}, {0, 0, 0}), kView);
  trace_primary(baked.source, tracer, camera, camera, g, progress);
  EXPECT_FALSE(g.on_gpu->has_surfaces());
  EXPECT_GT(std::ranges::count_if(g.view_z, [](float z) { return z > 0.0f; }), 300);
}

/// Ambient occlusion from points that stayed on the device; also where there is no memory for all of them at once, so
/// that they are read back.
TEST_F(DeviceSurfacesTest, PointsStayOnTheDevice) {
  const test::BakedScene baked(test::thicket_scene());
  const GpuTracer plenty(baked.file, baked.source, config_);
  AoConfig config;
  config.radius = 4.0f;
  Progress progress;
  GBuffer surfaces;
  trace_primary(baked.source, plenty.packed(), camera_, camera_, surfaces, progress);
  const uint64_t picture = 2 * kView.pixels() * (gpu::kPlaneWords * sizeof(uint32_t) + sizeof(RayHit));
  for (const bool little : {false, true}) {
    const SamplePlan plan{0, 2, little ? std::optional<uint32_t>() : 1, {}, {}};
    AoFrame expected, ao;
    const uint64_t rays = trace_ao(baked.source, plenty.packed(), surfaces, config, plan, expected, progress);
    GpuConfig device = config_;
    if (little) device.memory_limit_bytes = plenty.scene().bytes() + picture + 250'000;
    const GpuTracer tracer(baked.file, baked.source, device);
    GBuffer g;
    g.keep_channels(0);
    g.points_may_stay_on_gpu = true;
    trace_primary(baked.source, tracer, camera_, camera_, g, progress);
    EXPECT_TRUE(g.points_on_gpu && g.position.empty()) << little;
    ao.may_stay_on_gpu = true;
    EXPECT_EQ(trace_ao(baked.source, tracer, g, config, plan, ao, progress), rays);
    ASSERT_NE(ao.on_gpu, nullptr);
    tracer.read_occlusion(*ao.on_gpu, ao.ao, ao.hit_distance);
    EXPECT_EQ(ao.ao, expected.ao) << little;
    EXPECT_EQ(ao.hit_distance, expected.hit_distance) << little;
  }
}

} // namespace
} // namespace packtrace
