// Whole pictures on a GPU: the G-buffer and the ambient occlusion are those of the packed tracer, bit for bit.

#include <gtest/gtest.h>

#include "runtime/ao/ao_integrator.h"
#include "runtime/ao/view_occlusion.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/gpu/device_view.h"
#include "runtime/trace/gpu/gpu_tracer.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/gpu/same_surfaces.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

constexpr ImageSize kSize{77, 45};

class GpuPictureTest : public test::OnGpu {
protected:
  GpuPictureTest() : baked_(test::thicket_scene()), camera_(test::camera_at({0.1, 3, -12}, {0, 1, 0}), kSize) {}

  GBuffer primary(const RayTracer& tracer) const {
    GBuffer gbuffer;
    Progress progress;
    trace_primary(baked_.source, tracer, camera_, camera_, gbuffer, progress);
    return gbuffer;
  }

  /// Compares the G-buffers of both tracers. Returns that of the GPU.
  GBuffer expect_same_surfaces(const GpuTracer& tracer, const PrimaryCamera& now, const PrimaryCamera& before) const {
    GBuffer expected, gbuffer;
    Progress progress;
    trace_primary(baked_.source, tracer.packed(), now, before, expected, progress);
    trace_primary(baked_.source, tracer, now, before, gbuffer, progress);
    test::expect_same_surfaces(gbuffer, expected);
    EXPECT_EQ(gbuffer.albedo, expected.albedo);
    EXPECT_EQ(gbuffer.triangle, expected.triangle);
    EXPECT_EQ(gbuffer.material, expected.material);
    EXPECT_EQ(gbuffer.back_face, expected.back_face);
    EXPECT_GT(std::ranges::count_if(expected.view_z, [](float z) { return z > 0.0f; }), 100);
    expect_same_device_surfaces(tracer, now, before, expected);
    for (const std::string& message : tracer.scene().validation_messages()) ADD_FAILURE() << message;
    return gbuffer;
  }

  /// Compares the surfaces that the device makes, which have no other channels.
  void expect_same_device_surfaces(const GpuTracer& tracer, const PrimaryCamera& now, const PrimaryCamera& before,
                                   const GBuffer& expected) const {
    GBuffer gbuffer;
    gbuffer.keep_channels(0);
    Progress progress;
    trace_primary(baked_.source, tracer, now, before, gbuffer, progress);
    test::expect_same_surfaces(gbuffer, expected);
    EXPECT_EQ(gbuffer.on_gpu && gbuffer.on_gpu->has_surfaces(), now.projection() != Projection::kEnvironment);
  }

  /// Compares ambient occlusion of both tracers.
  /// @param on_device whether the device is to make the rays
  void expect_same_ao(const AoConfig& config, const SamplePlan& plan, bool on_device = true) const {
    const GpuTracer tracer(baked_.file, baked_.source, config_);
    EXPECT_EQ(traces_view_occlusion(config, plan), on_device);
    const GBuffer gbuffer = primary(tracer.packed());
    AoFrame expected, ao;
    Progress progress;
    const uint64_t rays = trace_ao(baked_.source, tracer.packed(), gbuffer, config, plan, expected, progress);
    EXPECT_EQ(trace_ao(baked_.source, tracer, gbuffer, config, plan, ao, progress), rays);
    EXPECT_EQ(ao.ao, expected.ao);
    EXPECT_EQ(ao.hit_distance, expected.hit_distance);
    EXPECT_EQ(ao.samples, expected.samples);
    size_t grey = 0;
    for (const float value : expected.ao) grey += value > 0.0f && value < 1.0f ? 1 : 0;
    EXPECT_GT(grey, 100u);
    for (const std::string& message : tracer.scene().validation_messages()) ADD_FAILURE() << message;
  }

  const test::BakedScene baked_;
  const PrimaryCamera camera_;
};

/// Surfaces of all kinds of cameras.
TEST_F(GpuPictureTest, PrimaryVisibility) {
  const GpuTracer tracer(baked_.file, baked_.source, config_);
  const GBuffer gbuffer = expect_same_surfaces(tracer, camera_, camera_);
  ASSERT_NE(gbuffer.on_gpu, nullptr) << "the device did not make the rays";
  EXPECT_GT(std::ranges::count_if(gbuffer.view_z, [](float z) { return z > 0.0f; }), 500);
  // Other cameras whose rays the device makes: shifted within pixels, moving, scaled and mirrored, far away,
  // orthographic.
  Camera camera = test::camera_at({0.1, 3, -12}, {0, 1, 0});
  const PrimaryCamera shifted(camera, kSize, {0.31, -0.27});
  expect_same_surfaces(tracer, shifted, camera_);
  camera.world_from_camera[0] *= -1.7, camera.world_from_camera[2] *= 0.3;
  expect_same_surfaces(tracer, PrimaryCamera(camera, kSize), camera_);
  Camera far = test::camera_at({3e5, 2e6, -1e7}, {0, 1, 0});
  far.fov_degrees = 1e-4;
  expect_same_surfaces(tracer, PrimaryCamera(far, kSize), PrimaryCamera(far, kSize));
  far.projection = Projection::kOrthographic;
  far.world_from_camera[0] *= 6.0, far.world_from_camera[1] *= 5.0;
  expect_same_surfaces(tracer, PrimaryCamera(far, kSize), PrimaryCamera(far, kSize));
  // The host makes the rays of environment cameras.
  Camera room = test::camera_at({0.1, 3, -12}, {0, 1, 0});
  room.projection = Projection::kEnvironment;
  const PrimaryCamera around(room, kSize);
  EXPECT_EQ(expect_same_surfaces(tracer, around, around).on_gpu, nullptr);
}

TEST_F(GpuPictureTest, NearestHitsWithFalloff) {
  AoConfig config;
  config.radius = 4.0f;
  config.seed = 0x123456789abcdefu;
  expect_same_ao(config, SamplePlan{0, 4, {}, {}, {}});
  config.continuous = false, config.min_visibility = 0.2f;
  expect_same_ao(config, SamplePlan{65535, 2, {}, {}, {}}); // across an epoch of the sampler
  config.continuous = true, config.lambda = 0.0f;
  expect_same_ao(config, SamplePlan{7, 1, {}, {}, {}});
}

TEST_F(GpuPictureTest, AnyHitsWithoutFalloff) {
  AoConfig config;
  config.radius = 4.0f;
  config.falloff = false;
  expect_same_ao(config, SamplePlan{0, 4, {}, {}, {}});
}

TEST_F(GpuPictureTest, EveryOtherPixel) {
  AoConfig config;
  config.radius = 4.0f;
  for (const uint32_t colour : {0u, 1u}) expect_same_ao(config, SamplePlan{3, 2, colour, {}, {}});
}

/// What the device does not make goes to it as spans of rays.
TEST_F(GpuPictureTest, OtherSamplersAndInterreflection) {
  AoConfig config;
  config.radius = 4.0f;
  config.sampler = SamplerKind::kPixelSobol;
  expect_same_ao(config, SamplePlan{0, 1, {}, {}, {}}, false);
  config.sampler = SamplerKind::kSpaceTimeNet, config.interreflection = 0.5f;
  expect_same_ao(config, SamplePlan{0, 1, {}, {}, {}}, false);
}

TEST_F(GpuPictureTest, ProgressReachesTheNumberOfPixels) {
  const GpuTracer tracer(baked_.file, baked_.source, config_);
  const GBuffer gbuffer = primary(tracer);
  uint64_t reached = 0;
  Progress progress([&](std::string_view, uint64_t done, uint64_t) { reached = std::max(reached, done); });
  progress.begin("occlusion", kSize.pixels());
  AoConfig config;
  AoFrame ao;
  trace_ao(baked_.source, tracer, gbuffer, config, SamplePlan{}, ao, progress);
  EXPECT_EQ(reached, kSize.pixels());
}

/// Where there is no room for the whole picture, its parts follow each other; where there is room for nothing, an error
/// says so.
TEST_F(GpuPictureTest, LittleDeviceMemory) {
  const GpuTracer plenty(baked_.file, baked_.source, config_);
  const GBuffer expected = primary(plenty.packed());
  AoConfig config;
  AoFrame expected_ao, ao;
  Progress progress;
  trace_ao(baked_.source, plenty.packed(), expected, config, SamplePlan{}, expected_ao, progress);
  const uint64_t scene_bytes = plenty.scene().bytes();
  GpuConfig little = config_;
  little.memory_limit_bytes = scene_bytes + 180'000; // the picture's points and sums alone have more
  const GpuTracer tracer(baked_.file, baked_.source, little);
  EXPECT_EQ(primary(tracer).view_z, expected.view_z);
  EXPECT_GT(kSize.pixels() * sizeof(OcclusionPoint), 120'000u);
  trace_ao(baked_.source, tracer, expected, config, SamplePlan{}, ao, progress);
  EXPECT_EQ(ao.ao, expected_ao.ao);
  little.memory_limit_bytes = scene_bytes + 10'000; // not even for the staged bytes of the upload
  try {
    const GpuTracer least(baked_.file, baked_.source, little);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded) << error.what();
  }
}

/// An observer that cancels stops the work between two dispatches.
TEST_F(GpuPictureTest, CancelInTheMiddle) {
  GpuConfig short_dispatches = config_;
  short_dispatches.dispatch_ms = 1e-3;
  const GpuTracer tracer(baked_.file, baked_.source, short_dispatches);
  const GBuffer gbuffer = primary(tracer);
  uint64_t reached = 0;
  Progress progress([&](std::string_view, uint64_t done, uint64_t) {
    reached = std::max(reached, done);
    if (reached > kSize.pixels() * 3 / 4) throw Error(ErrorKind::kCancelled, "stopped");
  });
  progress.begin("occlusion", kSize.pixels());
  AoConfig config;
  AoFrame ao;
  try {
    trace_ao(baked_.source, tracer, gbuffer, config, SamplePlan{0, 32, {}, {}, {}}, ao, progress);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kCancelled);
  }
  EXPECT_LT(reached, kSize.pixels());
  Progress fresh;
  AoFrame expected;
  trace_ao(baked_.source, tracer, gbuffer, config, SamplePlan{}, ao, fresh); // the device can go on
  trace_ao(baked_.source, tracer.packed(), gbuffer, config, SamplePlan{}, expected, fresh);
  EXPECT_EQ(ao.ao, expected.ao);
}

} // namespace
} // namespace packtrace
