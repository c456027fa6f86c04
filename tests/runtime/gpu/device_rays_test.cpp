// Rays that the device makes: every hit is the packed tracer's, for pictures of any size and any split of the samples.

#include "runtime/gpu/device_rays.h"

#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "runtime/gpu/timed_dispatches.h"
#include "runtime/trace/gpu/gpu_tracer.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

/// A camera at (0, 3, -12) that looks at the origin's surroundings.
gpu::CameraRecord camera_record(const UnitSpace& space, uint32_t width, uint32_t height) {
  const DVec3 eye = space.to_unit(DVec3(0.1, 3.0, -12.0));
  const double pixel = 1.2 / width;
  gpu::CameraRecord camera{};
  for (int axis = 0; axis < 3; ++axis) camera.eye[axis] = eye[axis];
  camera.corner[0] = -0.5 * pixel * width, camera.corner[1] = 0.5 * pixel * height - 0.2, camera.corner[2] = 1.0;
  camera.right[0] = pixel, camera.down[1] = -pixel;
  camera.width = width, camera.height = height;
  return camera;
}

std::span<const Ray> as_rays(const std::vector<packed::KernelRay>& rays) {
  return {reinterpret_cast<const Ray*>(rays.data()), rays.size()};
}

class DeviceRaysTest : public test::OnGpu {
protected:
  /// Traces a picture on the device and compares all camera rays. Returns the number of hits.
  static size_t compare_camera(const GpuTracer& tracer, gpu::DeviceRays& rays, const gpu::CameraRecord& camera) {
    rays.trace_camera(camera, true);
    const size_t pixels = size_t{camera.width} * camera.height;
    std::vector<packed::KernelRay> made(pixels);
    std::vector<packed::KernelHit> hits(pixels);
    rays.rays(made), rays.hits(hits);
    const std::vector<RayHit> expected = test::closest(tracer.packed(), as_rays(made));
    size_t found = 0, different = 0;
    for (size_t i = 0; i < pixels; ++i) {
      found += expected[i].valid() ? 1 : 0;
      different += std::memcmp(&hits[i].t, &expected[i].t, sizeof(float)) != 0 ||
                           hits[i].placement != expected[i].placement || hits[i].cluster != expected[i].part ||
                           hits[i].triangle != expected[i].triangle
                       ? 1
                       : 0;
    }
    EXPECT_EQ(different, 0u) << camera.width << " x " << camera.height;
    return found;
  }

  static gpu::OcclusionRecord samples(uint32_t order, uint32_t first, uint32_t count, uint32_t per_thread) {
    gpu::OcclusionRecord record{};
    record.first_sample = first, record.sample_count = count, record.per_thread = per_thread;
    record.order = order, record.seed = 12345;
    record.idle_lanes = order == gpu::kRandomOrder ? 2 : 8;
    record.tfar = 3e5f;
    record.inverse_radius = 1.0f / record.tfar, record.parabola = 1.0f, record.end = 1.0f, record.darkening = 1.0f;
    return record;
  }

  /// Counts the occluded samples of each point with the packed tracer.
  static std::vector<uint32_t> packed_counts(const GpuTracer& tracer, gpu::DeviceRays& rays,
                                             const gpu::OcclusionRecord& all) {
    std::vector<uint32_t> counts(rays.point_count());
    std::vector<packed::KernelRay> made(rays.point_count());
    for (uint32_t s = 0; s < all.sample_count; ++s) {
      gpu::OcclusionRecord one = all;
      one.first_sample = all.first_sample + s, one.sample_count = 1;
      rays.occlusion_rays(one, made);
      const std::vector<uint8_t> occluded = test::any(tracer.packed(), as_rays(made));
      for (size_t i = 0; i < counts.size(); ++i) counts[i] += occluded[i];
    }
    return counts;
  }

  static void expect_counts(const GpuTracer& tracer, gpu::DeviceRays& rays, const gpu::OcclusionRecord& record) {
    std::vector<uint32_t> counts(rays.point_count());
    rays.count_occluded(record);
    rays.counts(counts);
    const std::vector<uint32_t> expected = packed_counts(tracer, rays, record);
    EXPECT_EQ(counts, expected) << "order " << record.order << ", " << record.per_thread << " samples a thread";
    uint64_t occluded = 0;
    for (const uint32_t count : expected) occluded += count;
    EXPECT_GT(occluded, 0u);
  }

  /// Compares the distances of the nearest hits, summed by point, with those of the packed tracer.
  static void expect_distances(const GpuTracer& tracer, gpu::DeviceRays& rays, const gpu::OcclusionRecord& all) {
    std::vector<double> sums(2 * size_t{rays.point_count()}), distances, expected(rays.point_count());
    rays.sum_nearest(all);
    rays.sums(sums);
    for (size_t i = 1; i < sums.size(); i += 2) distances.push_back(sums[i]);
    std::vector<packed::KernelRay> made(rays.point_count());
    size_t hit = 0;
    for (uint32_t s = 0; s < all.sample_count; ++s) {
      gpu::OcclusionRecord one = all;
      one.first_sample = all.first_sample + s, one.sample_count = 1;
      rays.occlusion_rays(one, made);
      const std::vector<RayHit> hits = test::closest(tracer.packed(), as_rays(made), kOcclusionRays);
      for (size_t i = 0; i < hits.size(); ++i) {
        const bool point = made[i].tfar > 0.0f; // the device leaves pixels without a surface out
        const float way = hits[i].valid() ? std::min(hits[i].t * all.inverse_radius, 1.0f) : 1.0f;
        expected[i] += point ? double{way} : 0.0, hit += hits[i].valid() ? 1 : 0;
      }
    }
    EXPECT_GT(hit, 0u);
    EXPECT_EQ(distances, expected) << "order " << all.order << ", " << all.sample_count << " samples";
  }

  void expect_same(const test::BakedScene& baked, uint32_t width, uint32_t height) {
    for (const GpuOcclusion kernel : {GpuOcclusion::kQueue, GpuOcclusion::kWalk}) {
      GpuConfig config = config_;
      config.occlusion = kernel;
      expect_same(baked, config, width, height);
    }
  }

  void expect_same(const test::BakedScene& baked, const GpuConfig& config, uint32_t width, uint32_t height) {
    const GpuTracer tracer(baked.file, baked.source, config);
    gpu::DeviceRays rays(tracer.scene());
    EXPECT_GT(compare_camera(tracer, rays, camera_record(tracer.space(), width, height)), width * height / 10u);
    rays.make_points(1.0f);
    expect_counts(tracer, rays, samples(gpu::kRandomOrder, 0, 5, 2)); // three threads a point
    expect_distances(tracer, rays, samples(gpu::kNetOrder, 2, 3, 16));
    if (config.occlusion == GpuOcclusion::kQueue) {
      expect_counts(tracer, rays, samples(gpu::kDirectionOrder, 3, 4, 4));
      expect_counts(tracer, rays, samples(gpu::kNetOrder, 7, 2, 16));
    }
    for (const std::string& message : tracer.scene().validation_messages()) ADD_FAILURE() << message;
  }
};

Scene near_spheres() {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 1, 0}, 2, 32));
  test::add_shape(scene, test::quad({-8, -1, -8}, {0, 0, 16}, {16, 0, 0}));
  return scene;
}

TEST_F(DeviceRaysTest, OnePlacement) { expect_same(test::BakedScene(near_spheres()), 96, 60); }

Scene thicket_without_masks() {
  Scene scene = test::thicket_scene();
  for (Material& material : scene.materials) material.flags &= ~(kAlphaMask | kShadowAlphaMask);
  return scene;
}

TEST_F(DeviceRaysTest, ManyPlacements) { expect_same(test::BakedScene(thicket_without_masks()), 96, 60); }

TEST_F(DeviceRaysTest, ManyPlacementsWithMasks) { expect_same(test::BakedScene(test::thicket_scene()), 96, 60); }

TEST_F(DeviceRaysTest, FineGrids) {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kPositionBits;
  config.precision = 27;
  expect_same(test::BakedScene(near_spheres(), config), 48, 32);
}

TEST_F(DeviceRaysTest, PicturesOfAnySize) {
  const test::BakedScene baked(near_spheres());
  const GpuTracer tracer(baked.file, baked.source, config_);
  gpu::DeviceRays rays(tracer.scene());
  for (const auto& [width, height] : {std::pair{1u, 1u}, {7u, 3u}, {9u, 5u}, {33u, 21u}, {8u, 4u}})
    compare_camera(tracer, rays, camera_record(tracer.space(), width, height));
}

TEST_F(DeviceRaysTest, ShortDispatchesGiveTheSameCounts) {
  const test::BakedScene baked(test::thicket_scene());
  GpuConfig config = config_;
  config.dispatch_ms = 1e-6;
  const GpuTracer tracer(baked.file, baked.source, config);
  gpu::DeviceRays rays(tracer.scene());
  rays.trace_camera(camera_record(tracer.space(), 61, 43), true);
  rays.make_points(1.0f);
  for (int i = 0; i < 6; ++i) rays.count_occluded(samples(gpu::kNetOrder, 0, 4, 2)); // dispatches get shorter
  EXPECT_GT(rays.count_occluded(samples(gpu::kNetOrder, 0, 4, 2)).dispatches, 10u);
  expect_counts(tracer, rays, samples(gpu::kNetOrder, 0, 4, 2));
}

/// The faster kernel gets nearly all turns, by the size of dispatches, and another one once that takes less time.
TEST(FasterKernel, FollowsTheTimes) {
  gpu::FasterKernel kernels;
  struct Turns {
    int first = 0, both = 0;
  };
  const auto turns = [&](uint64_t rays, double first_ms, double second_ms) {
    Turns turns;
    for (int i = 0; i < 640; ++i) {
      const bool both = kernels.compares(rays);
      if (kernels.choice(rays) == 0) ++turns.first;
      if (!both) continue;
      kernels.add(rays, {first_ms, second_ms});
      ++turns.both;
    }
    return turns;
  };
  EXPECT_EQ(turns(1000, 1.0, 2.0).first, 640);
  EXPECT_LT(turns(1000000, 2.0, 1.0).first, 20);
  const Turns again = turns(1000, 1.0, 2.0);
  EXPECT_EQ(again.first, 640);
  EXPECT_EQ(again.both, 10);
  EXPECT_LT(turns(1000, 4.0, 1.0).first, 140);
}

/// A thread that gets no point, in a scene that rays cannot leave, must not hang.
TEST_F(DeviceRaysTest, PicturesThatSeeNothing) {
  const test::BakedScene baked(near_spheres());
  const GpuTracer tracer(baked.file, baked.source, config_);
  gpu::DeviceRays rays(tracer.scene());
  gpu::CameraRecord camera = camera_record(tracer.space(), 17, 9);
  camera.corner[2] = -1.0;
  EXPECT_EQ(compare_camera(tracer, rays, camera), 0u);
  rays.make_points(1.0f);
  rays.count_occluded(samples(gpu::kDirectionOrder, 0, 4, 4));
  std::vector<uint32_t> counts(rays.point_count());
  rays.counts(counts);
  EXPECT_EQ(counts, std::vector<uint32_t>(rays.point_count(), 0));
}

} // namespace
} // namespace packtrace
