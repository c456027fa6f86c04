// The denoiser on a GPU: its results are those of the CPU's.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/denoise/denoiser.h"
#include "runtime/gpu/device/device.h"
#include "tests/runtime/denoise/synthetic.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

using namespace synthetic;

constexpr ImageSize kSize{77, 45}; // no multiple of a group's pixels

double mean_square(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += double{a[i] - b[i]} * double{a[i] - b[i]};
  return sum / static_cast<double>(std::max<size_t>(a.size(), 1));
}
double rms(const std::vector<float>& a, const std::vector<float>& b) { return std::sqrt(mean_square(a, b)); }

size_t misses(const DenoisedAo& result) { return static_cast<size_t>(std::ranges::count(result.ao, kInvalidAo)); }

/// Compares results. AO that differs by 1e-4 from pictures with errors of 30 dB changes these by 3e-5 dB at most.
void expect_same(const DenoisedAo& result, const DenoisedAo& expected, const std::string& when) {
  ASSERT_EQ(result.ao.size(), expected.ao.size()) << when;
  EXPECT_EQ(misses(result), misses(expected)) << when;
  EXPECT_LT(rms(result.ao, expected.ao), 1e-4) << when;
  EXPECT_LT(rms(result.variance, expected.variance), 1e-5) << when;
  EXPECT_LT(rms(result.tspp, expected.tspp), 1e-3) << when;
}

/// Both denoisers, which get the same frames.
class BothDenoisers {
public:
  explicit BothDenoisers(const GpuConfig& device, const DenoiserConfig& config = {})
      : device_(gpu::Device::share(device)), cpu_(config), gpu_(config, &device) {}
  ~BothDenoisers() {
    for (const std::string& message : device_->validation_messages()) ADD_FAILURE() << message;
  }

  void add(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source = HistorySource::kMotion) {
    cpu_.add_frame(gbuffer, ao, source);
    gpu_.add_frame(gbuffer, ao, source);
  }
  void reset() { cpu_.reset(), gpu_.reset(); }
  void compare(const std::string& when) {
    const DenoisedAo &expected = cpu_.denoise(), &result = gpu_.denoise();
    expect_same(result, expected, when);
  }
  AoDenoiser& cpu() { return cpu_; }
  AoDenoiser& gpu() { return gpu_; }

private:
  const std::shared_ptr<gpu::Device> device_;
  AoDenoiser cpu_, gpu_;
};

std::string frame(uint32_t f) { return "frame " + std::to_string(f); }

/// Foliage and a floor, seen from a camera that may move, with ambient occlusion of a sample per pixel.
class ThicketView {
public:
  explicit ThicketView(ImageSize size = kSize)
      : size_(size), baked_(test::thicket_scene()), tracer_(baked_.file, baked_.source) {}

  void look_from(DVec3 eye) {
    const PrimaryCamera now(test::camera_at(eye, {0, 1, 0}), size_);
    Progress progress;
    trace_primary(baked_.source, tracer_, now, before_ ? *before_ : now, gbuffer, progress);
    before_ = now;
  }
  void sample(uint32_t number) {
    AoConfig config;
    config.radius = 4.0f;
    Progress progress;
    trace_ao(baked_.source, tracer_, gbuffer, config, number, ao, progress);
  }

  GBuffer gbuffer;
  AoFrame ao;

private:
  const ImageSize size_;
  const test::BakedScene baked_;
  const PackedTracer tracer_;
  std::optional<PrimaryCamera> before_;
};

/// A card before a wall, which has moved right by a fraction of a pixel more in each frame.
GBuffer moving_card(ImageSize size, uint32_t f) {
  constexpr float kStep = 2.4f;
  GBuffer g = wall(size);
  g.previous_z = g.view_z;
  for (uint32_t i = 0; i < size.pixels(); ++i) {
    const float x = static_cast<float>(i % size.width) - kStep * static_cast<float>(f);
    const uint32_t y = i / size.width;
    if (x < 10.0f || x >= 40.0f || y < 8 || y >= 36) continue;
    g.view_z[i] = g.previous_z[i] = 5.0f + 0.02f * x;
    g.normal[i] = Vec3(0.1f, 0.0f, -0.995f), g.instance[i] = 1, g.motion_px[i] = Vec2(kStep, 0);
  }
  return g;
}

class GpuDenoiserTest : public test::OnGpu {};

TEST_F(GpuDenoiserTest, StillsConverge) {
  ThicketView view;
  view.look_from({0.1, 3, -12});
  BothDenoisers both(config_);
  for (uint32_t f = 0; f < 20; ++f) {
    view.sample(f);
    both.add(view.gbuffer, view.ao, f == 0 ? HistorySource::kMotion : HistorySource::kUnchanged);
    if (f % 4 < 2) both.compare(frame(f));
  }
}

TEST_F(GpuDenoiserTest, HistoriesOfPixels) {
  ThicketView view;
  BothDenoisers both(config_);
  for (uint32_t f = 0; f < 6; ++f) {
    view.look_from({0.1 + 0.01 * f, 3, -12}); // as jittered camera rays do
    view.sample(f);
    view.ao.stratified = f % 2 != 0;
    both.add(view.gbuffer, view.ao, HistorySource::kPixel);
    both.compare(frame(f));
  }
}

TEST_F(GpuDenoiserTest, Orbit) {
  ThicketView view;
  BothDenoisers both(config_);
  for (uint32_t f = 0; f < 12; ++f) {
    const double angle = 0.012 * std::min(f, 8u); // then it stands still, which the denoiser must detect
    view.look_from({12.0 * std::sin(angle), 3.0 + 0.05 * std::min(f, 8u), -12.0 * std::cos(angle)});
    view.sample(f);
    both.add(view.gbuffer, view.ao);
    both.compare(frame(f));
  }
}

/// PSNR of moving views against the mean of many samples.
TEST_F(GpuDenoiserTest, PsnrIsThatOfTheCpu) {
  ThicketView view;
  BothDenoisers both(config_);
  for (uint32_t f = 0; f < 6; ++f) {
    view.look_from({0.1 * f, 3, -12});
    view.sample(f);
    both.add(view.gbuffer, view.ao);
  }
  std::vector<float> truth(kSize.pixels());
  constexpr uint32_t kSamples = 256;
  for (uint32_t s = 0; s < kSamples; ++s) {
    view.sample(1000 + s);
    for (size_t i = 0; i < truth.size(); ++i) truth[i] += view.ao.ao[i] / float{kSamples};
  }
  const DenoisedAo &expected = both.cpu().denoise(), &result = both.gpu().denoise();
  const double cpu_db = -10.0 * std::log10(mean_square(expected.ao, truth)),
               gpu_db = -10.0 * std::log10(mean_square(result.ao, truth));
  EXPECT_GT(cpu_db, 15.0);
  EXPECT_NEAR(gpu_db, cpu_db, 0.1);
}

TEST_F(GpuDenoiserTest, MovingObject) {
  BothDenoisers both(config_);
  for (uint32_t f = 0; f < 10; ++f) {
    AoFrame ao = noise(kSize, 0.4f, f);
    if (f == 7)
      for (size_t i = 0; i < kSize.pixels(); ++i) ao.max_history.push_back(static_cast<float>(i % 5));
    both.add(moving_card(kSize, f), ao);
    both.compare(frame(f));
  }
}

/// AO that becomes darker shortens histories.
TEST_F(GpuDenoiserTest, ChangesAreCorrected) {
  BothDenoisers both(config_);
  for (uint32_t f = 0; f < 14; ++f) {
    both.add(wall(kSize), noise(kSize, f < 8 ? 0.1f : 0.8f, f));
    if (f > 6) both.compare(frame(f));
  }
  EXPECT_LT(mean_of(both.gpu().denoise().tspp, kSize, all(kSize)), 10.0);
}

TEST_F(GpuDenoiserTest, CutsAndSizes) {
  BothDenoisers both(config_);
  for (const ImageSize size : {kSize, ImageSize{33, 17}, ImageSize{1, 1}, ImageSize{3, 70}, ImageSize{64, 32}}) {
    for (uint32_t f = 0; f < 3; ++f) {
      both.add(moving_card(size, f), noise(size, 0.5f, f));
      both.compare(std::to_string(size.width) + " " + frame(f));
    }
    both.reset();
    both.add(moving_card(size, 3), noise(size, 0.5f, 9));
    both.compare(std::to_string(size.width) + " after a cut");
    EXPECT_EQ(*std::ranges::max_element(both.gpu().denoise().tspp), 1.0f);
  }
}

TEST_F(GpuDenoiserTest, DamagedInput) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  BothDenoisers both(config_);
  for (uint32_t f = 0; f < 6; ++f) {
    GBuffer g = moving_card(kSize, f);
    AoFrame ao = noise(kSize, 0.5f, f);
    const float bad[] = {kNan, kInfinity, -kInfinity, -1.0f, 0.0f, 1e-40f, 1e38f, 2.5f};
    for (size_t i = 0; i < std::size(bad); ++i) {
      g.view_z[700 + 9 * i] = bad[i], g.normal[900 + 9 * i] = Vec3(bad[i], 0, 0), ao.ao[1100 + 9 * i] = bad[i];
      g.motion_px[1300 + 9 * i] = Vec2(bad[i], 0), g.previous_z[1500 + 9 * i] = bad[i];
    }
    for (uint32_t x = 20; x < 50; ++x) // no samples in a block
      for (uint32_t y = 20; y < 40; ++y) ao.ao[y * kSize.width + x] = kInvalidAo;
    both.add(g, ao);
    both.compare(frame(f));
  }
}

/// With stratified samples, whose variance decreases faster, and with several samples per pixel.
TEST_F(GpuDenoiserTest, VarianceOfStratifiedSamples) {
  for (const uint32_t samples : {1u, 4u}) {
    DenoiserConfig config;
    config.set("ratio_prior=100");
    BothDenoisers both(config_, config);
    AoDenoiser usual(DenoiserConfig{}), of_one(config);
    for (uint32_t f = 0; f < 12; ++f) {
      AoFrame ao = noise(kSize, 0.4f, f);
      ao.stratified = true, ao.samples = samples;
      const HistorySource source = f == 0 ? HistorySource::kMotion : HistorySource::kUnchanged;
      both.add(wall(kSize), ao, source);
      usual.add_frame(wall(kSize), ao, source);
      ao.samples = 1;
      of_one.add_frame(wall(kSize), ao, source);
    }
    both.compare(std::to_string(samples) + " samples");
    const std::vector<float>& variance = both.cpu().denoise().variance;
    EXPECT_GT(rms(variance, usual.denoise().variance), 1e-5) << "the setting has no effect that can be seen";
    if (samples > 1) {
      EXPECT_GT(rms(variance, of_one.denoise().variance), 1e-5) << "nor do samples";
    }
  }
}

/// Every setting reaches the kernels.
TEST_F(GpuDenoiserTest, Settings) {
  ThicketView view({48, 32});
  for (const char* setting : {"passes=0",
                              "passes=1",
                              "passes=3",
                              "window=3",
                              "reprojection_normal_power=1",
                              "reprojection_instance_test=0",
                              "max_tspp=3",
                              "max_tspp_moving=2",
                              "fast_frames=2",
                              "change_gamma=0.3",
                              "change_tolerance=0.1",
                              "change_response=50",
                              "reprojection_depth=0.2",
                              "reprojection_slope=5",
                              "reprojection_nearby=0",
                              "reprojection_nearby=1",
                              "guide_depth=0.5",
                              "guide_slope=4",
                              "guide_bend=0",
                              "noise_tolerance=0.5",
                              "patch_limit=1",
                              "variance_prior=100",
                              "variance_distrust=100",
                              "ratio_prior=100"}) {
    DenoiserConfig config;
    config.set(setting);
    BothDenoisers both(config_, config);
    for (uint32_t f = 0; f < 4; ++f) {
      view.look_from({0.2 * (f / 2), 3, -12});
      view.sample(f);
      both.add(view.gbuffer, view.ao);
    }
    both.compare(setting);
  }
}

TEST_F(GpuDenoiserTest, SameBytesInEveryRun) {
  ThicketView view;
  AoDenoiser first({}, &config_), second({}, &config_), restored({}, &config_);
  for (uint32_t f = 0; f < 5; ++f) {
    view.look_from({0.1 * f, 3, -12});
    view.sample(f);
    first.add_frame(view.gbuffer, view.ao), second.add_frame(view.gbuffer, view.ao);
    EXPECT_EQ(first.denoise().ao, second.denoise().ao) << frame(f);
  }
  restored.restore(kSize, first.save());
  view.look_from({0.5, 3, -12});
  view.sample(5);
  first.add_frame(view.gbuffer, view.ao), restored.add_frame(view.gbuffer, view.ao);
  EXPECT_EQ(first.denoise().ao, restored.denoise().ao);
  EXPECT_EQ(first.denoise().tspp, restored.denoise().tspp);
  EXPECT_THROW(restored.restore({7, 7}, first.save()), Error);
}

TEST_F(GpuDenoiserTest, HistoriesOfOtherLayoutsAreRefused) {
  AoDenoiser on_cpu(DenoiserConfig{}), on_gpu({}, &config_);
  on_cpu.add_frame(wall(kSize), noise(kSize, 0.5f, 0)), on_gpu.add_frame(wall(kSize), noise(kSize, 0.5f, 0));
  std::vector<std::byte> untagged = on_gpu.save();
  untagged.erase(untagged.begin(), untagged.begin() + 8);
  for (const std::vector<std::byte>& bytes : {on_cpu.save(), untagged, std::vector<std::byte>(3)}) try {
      on_gpu.restore(kSize, bytes);
      FAIL() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find("another backend or version"), std::string::npos) << error.what();
    }
}

TEST_F(GpuDenoiserTest, OtherPresetsAreRefused) {
  DenoiserConfig config;
  config.kind = DenoiserKind::kReference;
  try {
    const AoDenoiser denoiser(config, &config_);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported) << error.what();
  }
}

TEST_F(GpuDenoiserTest, LittleDeviceMemory) {
  GpuConfig little = config_;
  little.memory_limit_bytes = 100'000;
  AoDenoiser denoiser({}, &little);
  for (int attempt = 0; attempt < 2; ++attempt) try {
      denoiser.add_frame(wall(kSize), noise(kSize, 0.5f, 0));
      FAIL() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded) << error.what();
    }
  AoDenoiser enough({}, &config_);
  enough.add_frame(wall(kSize), noise(kSize, 0.5f, 0));
  EXPECT_THROW(denoiser.restore(kSize, enough.save()), Error);
  EXPECT_THROW(denoiser.add_frame(wall(kSize), noise(kSize, 0.5f, 0)), Error) << "its buffers have not been made";
  EXPECT_EQ(denoiser.next_frame(wall({8, 8}), noise({8, 8}, 0.5f, 0)).ao.size(), 64u);
}

} // namespace
} // namespace packtrace
