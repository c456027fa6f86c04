// Frames with backend gpu: rays and the denoiser on the device give the picture of backend packed.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "runtime/frame/frame_loop.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

class GpuFrameTest : public test::OnGpu {
protected:
  GpuFrameTest() : baked_(test::thicket_scene()) {
    settings_.size = {67, 41};
    settings_.ao.radius = 4.0f;
  }

  FrameScene scene(Backend backend) const {
    FrameScene scene{&baked_.source, &baked_.file, {}};
    scene.backend.backend = backend, scene.backend.gpu = config_;
    return scene;
  }

  /// Compares every picture of a view that moves, then stands still with jittered camera rays, then jumps.
  void expect_same_pictures() const {
    FrameLoop expected(scene(Backend::kPacked), settings_), on_gpu(scene(Backend::kGpu), settings_);
    for (uint32_t f = 0; f < 9; ++f) {
      const double x = f < 4 ? 0.1 * f : f < 8 ? 0.4 : 5.0;
      const Camera camera = test::camera_at({x, 3, -12}, {0, 1, 0});
      RenderedImage pictures[2];
      PictureReport reports[2];
      Progress progress;
      expected.next_frame(camera, 0.0, progress), on_gpu.next_frame(camera, 0.0, progress);
      expected.resolve(pictures[0], reports[0]), on_gpu.resolve(pictures[1], reports[1]);
      EXPECT_EQ(pictures[1].ao_raw, pictures[0].ao_raw) << f;
      EXPECT_EQ(pictures[1].depth, pictures[0].depth) << f;
      ASSERT_EQ(pictures[1].ao.size(), pictures[0].ao.size());
      double most = 0.0;
      for (size_t i = 0; i < pictures[0].ao.size(); ++i)
        most = std::max(most, std::abs(double{pictures[1].ao[i]} - double{pictures[0].ao[i]}));
      EXPECT_LT(most, 0.01) << f;
      EXPECT_NEAR(reports[1].mean_history, reports[0].mean_history, 1e-3) << f;
    }
  }

  const test::BakedScene baked_;
  FrameConfig settings_;
};

TEST_F(GpuFrameTest, PicturesAreThoseOfPacked) { expect_same_pictures(); }

/// As in a window: depths, normals and motion of moving frames stay on the device until a layer shows them.
TEST_F(GpuFrameTest, OcclusionAlone) {
  settings_.plain_layers = 0, settings_.all_channels = false;
  expect_same_pictures();
  settings_.jitter = false;
  expect_same_pictures();
}

TEST_F(GpuFrameTest, LayersOfAMovingFrameThatAreShownLater) {
  settings_.plain_layers = 0, settings_.all_channels = false;
  FrameConfig with_layers = settings_;
  with_layers.plain_layers = kDepthLayer | kNormalLayer, with_layers.view_layers = true;
  FrameLoop expected(scene(Backend::kPacked), with_layers), on_gpu(scene(Backend::kGpu), settings_);
  Progress progress;
  for (const double x : {0.0, 0.1, 0.1}) { // the last frame is still
    RenderedImage pictures[2];
    PictureReport reports[2];
    const Camera camera = test::camera_at({x, 3, -12}, {0, 1, 0});
    expected.next_frame(camera, 0.0, progress), on_gpu.next_frame(camera, 0.0, progress);
    expected.resolve(pictures[0], reports[0]), on_gpu.resolve(pictures[1], reports[1]);
    EXPECT_TRUE(pictures[1].depth.empty());
    on_gpu.show_layers(with_layers);
    on_gpu.resolve(pictures[1], reports[1]);
    on_gpu.show_layers(settings_);
    EXPECT_EQ(pictures[1].depth, pictures[0].depth) << x;
    EXPECT_EQ(pictures[1].normal, pictures[0].normal) << x;
    EXPECT_EQ(on_gpu.gbuffer().motion_px, expected.gbuffer().motion_px) << x;
  }
}

/// The error of proxies is measured from points on the host, so points must not stay on the device.
TEST_F(GpuFrameTest, Proxies) {
  BakeConfig config;
  config.proxy.use = ProxyUse::kVoxels;
  Scene spheres;
  test::add_object(spheres, test::sphere({0, 0, 0}, 2, 64));
  for (const double x : {-2.0, 2.0}) spheres.instances.push_back({0, Affine(test::placed({x, 1, 0}, DVec3(1), 0))});
  const test::BakedScene baked(spheres, config);
  settings_.plain_layers = 0, settings_.all_channels = false;
  settings_.proxy_beyond_px = 1000.0, settings_.proxy_error = 1.0;
  std::optional<double> errors[2];
  for (const Backend backend : {Backend::kPacked, Backend::kGpu}) {
    FrameScene scene{&baked.source, &baked.file, {}};
    scene.backend.backend = backend, scene.backend.gpu = config_;
    FrameLoop loop(scene, settings_);
    Progress progress;
    loop.next_frame(test::camera_at({0, 3, -12}, {0, 1, 0}), 0.0, progress);
    errors[backend == Backend::kGpu] = loop.proxy_error();
  }
  ASSERT_TRUE(errors[0]);
  EXPECT_EQ(errors[1], errors[0]);
}

TEST_F(GpuFrameTest, AQuarterOfThePixels) {
  settings_.ao_resolution = AoResolution::kQuarter;
  settings_.ao_rate = AoRate::kCheckerboard;
  expect_same_pictures();
}

TEST_F(GpuFrameTest, WithoutDenoiser) {
  settings_.denoise = false;
  settings_.denoiser.kind = DenoiserKind::kReference; // never denoised
  expect_same_pictures();
}

TEST_F(GpuFrameTest, PresetsThatItLacksAreRefused) {
  settings_.denoiser.kind = DenoiserKind::kReference;
  try {
    const FrameLoop loop(scene(Backend::kGpu), settings_);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported) << error.what();
  }
}

} // namespace
} // namespace packtrace
