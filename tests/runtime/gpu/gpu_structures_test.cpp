// Backend gpu-rt: what its structures are built from is checked on every device, the rest where a driver has them.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "runtime/camera/lod_view.h"
#include "runtime/gpu/gpu_scene_state.h"
#include "runtime/gpu/shaders/spirv.h"
#include "runtime/trace/gpu/gpu_tracer.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/packed/scene/trace_cluster.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::placed;

constexpr size_t kManyRays = 20000;

Bounds near_objects() {
  Bounds bounds;
  bounds.extend(DVec3(-8, -0.5, -8)), bounds.extend(DVec3(8, 5, 8));
  return bounds;
}

/// A sphere for all rays, one for camera rays, and one for occlusion rays.
Scene scene_of_classes() {
  Scene scene;
  add_shape(scene, test::sphere({-3, 0, 0}, 1, 24));
  add_shape(scene, test::sphere({0, 0, 0}, 1, 24), kTransmissive);
  add_shape(scene, test::sphere({3, 0, 0}, 1, 24), kInvisible);
  return scene;
}

// --- on every device ---

TEST(GpuStructures, EachClusterIsInOneStructureOfItsClass) {
  for (const Scene& scene : {scene_of_classes(), test::varied_scene(), test::thicket_scene()}) {
    const test::BakedScene baked(scene);
    const PackedTracer tracer(baked.file, baked.source);
    const GpuTables tables(baked.file, baked.source, tracer, GpuStructures::kDriver);
    const TracedTrees& traced = tracer.traced_trees();
    std::map<uint32_t, uint32_t> times; // by cluster
    for (const gpu::BottomLevel& level : tables.bottom_levels())
      for (size_t part = 0; part < 2; ++part) {
        uint64_t triangles = 0;
        const auto ranges = tables.ranges().subspan(level.parts[part].first_range, level.parts[part].range_count);
        for (const gpu::RangeRecord& range : ranges) {
          const packed::TraceCluster& cluster = traced.clusters()[range.cluster];
          ++times[range.cluster];
          EXPECT_EQ(range.first_triangle, triangles);
          EXPECT_EQ(cluster.flags & 3u, level.ray_classes);
          EXPECT_EQ((cluster.flags & packed::kMasked) != 0, part == 1);
          triangles += cluster.triangle_count;
        }
        EXPECT_EQ(triangles, level.parts[part].triangles);
      }
    for (uint32_t i = 0; i < traced.clusters().size(); ++i)
      EXPECT_EQ(times[i], traced.clusters()[i].bits != nullptr && (traced.clusters()[i].flags & 3u) != 0 ? 1u : 0u);
    EXPECT_TRUE(tables.view().nodes.empty()) << "the driver reads no nodes";
    const std::set<StructureKey> keys(tables.structure_keys().begin(), tables.structure_keys().end());
    EXPECT_EQ(keys.size(), tables.bottom_levels().size());
  }
}

class GpuStructuresOnAnyDevice : public test::OnGpu {};

/// Decodes a triangle of a cluster on the CPU, in the grid of its tree.
void decode(const BakedFile& file, const PackedTracer& tracer, uint32_t cluster, uint32_t triangle,
            packed::DecodedBatch& out) {
  uint32_t g = 0;
  while (cluster >= file.geometries()[g].first_cluster + file.geometries()[g].cluster_count) ++g;
  const baked::GeometryRecord& geometry = file.geometries()[g];
  const TracedTrees& traced = tracer.traced_trees();
  decode_batch_exactly(traced.records[traced.grid_of[g]], geometry,
                       file.cluster(g, static_cast<uint32_t>(cluster - geometry.first_cluster)), triangle, 1, out);
}

/// The kernel that feeds builds decodes what the CPU's kernels decode.
TEST_F(GpuStructuresOnAnyDevice, DecodedTriangles) {
  for (const double bits : {16.0, 27.0}) {
    BakeConfig config;
    config.precision_kind = PrecisionKind::kPositionBits;
    config.precision = bits;
    const test::BakedScene baked(scene_of_classes(), config);
    const PackedTracer tracer(baked.file, baked.source);
    const GpuTables tables(baked.file, baked.source, tracer, GpuStructures::kDriver);
    const gpu::GpuScene scene(config_, tables.view());
    const auto& device = scene.state().device;
    const auto kernel =
        scene.state().make_kernel(gpu::spirv::decode_triangles(), gpu::kSceneBindings + 2, sizeof(gpu::SpanRecord));
    const gpu::Buffer ranges = gpu::upload(device, std::as_bytes(tables.ranges()), "ranges");
    kernel->bind(gpu::kSceneBindings, ranges);
    size_t compared = 0, different = 0;
    for (const gpu::BottomLevel& level : tables.bottom_levels()) {
      const gpu::BottomLevel::Part& part = level.parts[0];
      const gpu::Buffer vertices(device, part.triangles * 9 * sizeof(float), gpu::BufferPlace::kHost, "vertices");
      kernel->bind(gpu::kSceneBindings + 1, vertices);
      const gpu::SpanRecord span{part.first_range, part.range_count, 0, 0};
      device->run(*kernel, std::as_bytes(std::span(&span, 1)), part.range_count);
      for (const gpu::RangeRecord& range : tables.ranges().subspan(part.first_range, part.range_count)) {
        const uint32_t triangles = tracer.traced_trees().clusters()[range.cluster].triangle_count;
        for (uint32_t t = 0; t < triangles; ++t) {
          packed::DecodedBatch expected;
          decode(baked.file, tracer, range.cluster, t, expected);
          const float* const got = vertices.as<float>() + 9 * (range.first_triangle + t);
          for (int i = 0; i < 9; ++i) different += got[i] == expected.vertex[i % 3][i / 3][0] ? 0 : 1;
          ++compared;
        }
      }
    }
    EXPECT_EQ(different, 0u);
    EXPECT_GT(compared, 1000u);
  }
}

/// Devices of CPUs have no acceleration structures: that is said, and nothing else is used.
TEST_F(GpuStructuresOnAnyDevice, DevicesWithoutStructures) {
  GpuConfig config = config_;
  config.structures = GpuStructures::kDriver;
  const test::BakedScene baked(scene_of_classes());
  try {
    const GpuTracer tracer(baked.file, baked.source, config);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
    const std::string message = error.what();
    EXPECT_NE(message.find("lacks acceleration structures and ray tracing pipelines"), std::string::npos) << message;
    return;
  }
  GTEST_SKIP() << "the device has acceleration structures";
}

TEST(GpuStructures, NamesOfBackends) {
  TracerConfig config;
  EXPECT_TRUE(set_backend(config, "gpu-rt"));
  EXPECT_EQ(config.backend, Backend::kGpu);
  EXPECT_EQ(config.gpu.structures, GpuStructures::kDriver);
  EXPECT_TRUE(set_backend(config, "gpu"));
  EXPECT_EQ(config.gpu.structures, GpuStructures::kPacked);
  EXPECT_TRUE(set_backend(config, "packed"));
  EXPECT_EQ(config.backend, Backend::kPacked);
  EXPECT_FALSE(set_backend(config, "gpu-rtx"));
}

// --- where a driver has acceleration structures ---

class GpuStructuresTest : public test::OnGpu {
protected:
  void SetUp() override {
    OnGpu::SetUp();
    if (IsSkipped()) return;
    config_rt_.structures = GpuStructures::kDriver;
    try {
      gpu::Device::share(config_rt_);
    } catch (const Error& error) {
      if (std::string(error.what()).find("lacks acceleration structures") == std::string::npos) throw;
      GTEST_SKIP() << error.what();
    }
  }

  /// Compares rays of both classes: nearly all hit what the packed tracer hits. Rounding decides at edges.
  void expect_nearly_same(const GpuTracer& tracer, std::span<const Ray> rays, size_t least_hits) {
    for (const uint32_t ray_class : {kCameraRays, kOcclusionRays}) {
      const std::vector<RayHit> expected = test::closest(tracer.packed(), rays, ray_class),
                                hits = test::closest(tracer, rays, ray_class);
      const std::vector<uint8_t> occluded = test::any(tracer, rays, ray_class);
      size_t other_hit = 0, other_t = 0, other_any = 0, found = 0;
      for (size_t i = 0; i < rays.size(); ++i) {
        found += expected[i].valid() ? 1 : 0;
        other_any += (occluded[i] != 0) == expected[i].valid() ? 0 : 1;
        if (hits[i].valid() != expected[i].valid() || hits[i].placement != expected[i].placement ||
            hits[i].part != expected[i].part || hits[i].triangle != expected[i].triangle)
          ++other_hit;
        else if (expected[i].valid() && !(std::abs(hits[i].t - expected[i].t) <= 1e-4f * expected[i].t + 1e-6f))
          ++other_t;
      }
      EXPECT_LE(other_hit, rays.size() / 1000) << "class " << ray_class;
      EXPECT_LE(other_t, rays.size() / 1000) << "class " << ray_class;
      EXPECT_LE(other_any, rays.size() / 1000) << "class " << ray_class;
      EXPECT_GE(found, least_hits) << "class " << ray_class;
    }
    for (const std::string& message : tracer.scene().validation_messages()) ADD_FAILURE() << message;
  }

  GpuConfig config_rt_ = config_;
};

TEST_F(GpuStructuresTest, ClassesOfRays) {
  const test::BakedScene baked(scene_of_classes());
  const GpuTracer tracer(baked.file, baked.source, config_rt_);
  EXPECT_EQ(tracer.name(), "gpu-rt");
  expect_nearly_same(tracer, test::random_rays(kManyRays, baked.source.world_bounds(), tracer.space()), kManyRays / 20);
}

TEST_F(GpuStructuresTest, MasksAndManyPlacements) {
  for (const Scene& scene : {test::varied_scene(), test::thicket_scene()}) {
    const test::BakedScene baked(scene);
    const GpuTracer tracer(baked.file, baked.source, config_rt_);
    expect_nearly_same(tracer, test::random_rays(kManyRays, near_objects(), tracer.space(), 3), kManyRays / 10);
  }
}

TEST_F(GpuStructuresTest, MovedInstances) {
  const test::BakedScene baked(test::thicket_scene());
  Movers movers;
  movers.instances = {static_cast<uint32_t>(baked.source.instances().size()) - 1};
  movers.world.extend(DVec3(-20)), movers.world.extend(DVec3(20));
  GpuTracer tracer(baked.file, baked.source, config_rt_, movers);
  const Affine moved[] = {Affine(placed({0, 3, 0}, DVec3(4), 30))};
  tracer.place_instances(movers.instances, moved);
  const std::vector<Ray> rays = test::random_rays(kManyRays, near_objects(), tracer.space(), 3);
  expect_nearly_same(tracer, rays, kManyRays / 4);
  size_t on_mover = 0;
  for (const RayHit& hit : test::closest(tracer, rays))
    on_mover += hit.valid() && tracer.resolve(hit).placement->instance == movers.instances[0] ? 1 : 0;
  EXPECT_GT(on_mover, 100u);
}

/// Structures are compacted, shared by tracers of the same clusters, and freed some frames after the last one.
TEST_F(GpuStructuresTest, TheirMemory) {
  const test::BakedScene baked(test::thicket_scene());
  const auto cache = std::make_shared<StructureCache>(config_rt_);
  const PrimaryCamera camera(test::camera_at({0, 2, -10}, {0, 1, 0}), {64, 48});
  {
    const GpuTracer first(baked.file, baked.source, config_rt_, {}, cache);
    const StructureStats built = cache->stats();
    EXPECT_EQ(built.built, built.live);
    EXPECT_GT(built.compacted, 0u);
    EXPECT_LT(built.resident_bytes, built.worst_case_bytes);
    EXPECT_GE(built.peak_bytes, built.worst_case_bytes);
    const GpuTracer second(baked.file, baked.source, config_rt_, {}, cache);
    EXPECT_EQ(cache->stats().built, built.built) << "nothing is built twice";
    uint64_t bytes = 0;
    for (const TreeBytes& tree : second.tree_bytes()) bytes += tree.built;
    EXPECT_EQ(bytes, built.resident_bytes);
  }
  const uint64_t all = cache->stats().live;
  const GpuTracer last(baked.file, baked.source, config_rt_, {}, cache);
  EXPECT_EQ(cache->stats().live, all) << "taken again before they were dropped";
  Progress progress;
  for (int i = 0; i < 20; ++i) last.trace_camera(camera, kCameraRays, nullptr, progress);
  EXPECT_EQ(cache->stats().live, all) << "in use";
  EXPECT_EQ(cache->stats().dropped, 0u);
  expect_nearly_same(last, test::random_rays(kManyRays, near_objects(), last.space()), kManyRays / 10);
}

/// Whatever the limit of memory, a scene is traced or refused, and the cache goes on.
TEST_F(GpuStructuresTest, LittleMemory) {
  const test::BakedScene baked(test::thicket_scene());
  GpuConfig config = config_rt_;
  config.memory_limit_bytes = uint64_t{1} << 30;
  const auto cache = std::make_shared<StructureCache>(config);
  uint64_t enough = 0;
  {
    const GpuTracer tracer(baked.file, baked.source, config, {}, cache);
    enough = cache->memory()->device()->allocated_bytes();
  }
  for (uint64_t limit = 1 << 20; limit < enough; limit += enough / 6) {
    config.memory_limit_bytes = limit;
    const auto small = std::make_shared<StructureCache>(config);
    EXPECT_THROW(GpuTracer(baked.file, baked.source, config, {}, small), Error) << limit;
    EXPECT_THROW(GpuTracer(baked.file, baked.source, config, {}, small), Error) << limit;
  }
}

TEST_F(GpuStructuresTest, LevelsOfDetail) {
  Scene scene = scene_of_classes();
  add_object(scene, test::sphere({0, 0, 0}, 1, 40));
  for (const double z : {3.0, 60.0}) scene.instances.push_back({0, Affine(placed({2, 1, z}))});
  BakeConfig config;
  config.lod = LodUse::kAll;
  const test::BakedScene baked(scene, config);
  const PrimaryCamera camera(test::camera_at({1, 3, -10}, {0, 1, 0}), {96, 64});
  const std::vector<LodGeometry> geometries = lod_geometries(baked.file);
  const std::vector<LodInstance> instances = lod_instances(baked.source);
  LodSharing sharing(geometries, instances, {});
  const LodPlan plan = sharing.plan(detail_view(camera, baked.file.world_bounds(), 2.0));
  const LodSource source(baked.file, baked.source, sharing, plan);
  const GpuTracer tracer(baked.file, source, config_rt_);
  expect_nearly_same(tracer, test::random_rays(kManyRays, baked.source.world_bounds(), tracer.space()), 60);
}

} // namespace
} // namespace packtrace
