// Frames with backend gpu: rays and the denoiser on the device give the picture of backend packed.

#include <algorithm>
#include <cmath>
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

TEST_F(GpuFrameTest, AQuarterOfThePixels) {
  settings_.ao_resolution = AoResolution::kQuarter;
  settings_.ao_rate = AoRate::kCheckerboard;
  expect_same_pictures();
}

TEST_F(GpuFrameTest, WithoutDenoiser) {
  settings_.denoise = false;
  settings_.denoiser.kind = DenoiserKind::kReference; // nobody asks for it
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
