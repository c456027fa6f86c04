#include "runtime/denoise/denoiser.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/isa.h"
#include "tests/runtime/denoise/synthetic.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using namespace synthetic;

constexpr ImageSize kOddSize{67, 45};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

void expect_sound(const DenoisedAo& result) {
  for (size_t i = 0; i < result.size.pixels(); ++i) {
    ASSERT_TRUE(result.ao[i] == kInvalidAo || (result.ao[i] >= 0.0f && result.ao[i] <= 1.0f)) << "pixel " << i;
    ASSERT_TRUE(result.variance[i] >= 0.0f && result.variance[i] <= 1.0f) << "pixel " << i;
    ASSERT_TRUE(result.tspp[i] >= 0.0f && result.tspp[i] <= 65535.0f) << "pixel " << i;
  }
}

TEST(AoDenoiser, OneDamagedTexelStaysOneTexelAndHealsInTwoFrames) {
  using Damage = std::function<void(GBuffer&, AoFrame&, size_t, float)>;
  const std::vector<Damage> damages = {
      [](GBuffer&, AoFrame& a, size_t i, float v) { a.ao[i] = v; },
      [](GBuffer&, AoFrame& a, size_t i, float v) { a.hit_distance[i] = v; },
      [](GBuffer& g, AoFrame&, size_t i, float v) { g.view_z[i] = v; },
      [](GBuffer& g, AoFrame&, size_t i, float v) { g.normal[i].y = v; },
      [](GBuffer& g, AoFrame&, size_t i, float v) { g.position[i].x = v; },
      [](GBuffer& g, AoFrame&, size_t i, float v) { g.motion_px[i].x = v; },
  };
  const size_t damaged = 20 * kOddSize.width + 30;
  for (size_t kind = 0; kind < damages.size(); ++kind)
    for (float value : {kNan, kInfinity, -kInfinity, -1e30f, 3e38f, 1e-42f}) {
      SCOPED_TRACE(testing::Message() << "array " << kind << " value " << value);
      AoDenoiser clean, hurt;
      for (uint32_t f = 0; f < 12; ++f) {
        GBuffer g = wall(kOddSize);
        AoFrame frame = noise(kOddSize, 0.4f, f);
        const DenoisedAo expected = clean.next_frame(g, frame);
        if (f == 8) damages[kind](g, frame, damaged, value);
        const DenoisedAo& result = hurt.next_frame(g, frame);
        expect_sound(result);
        for (size_t i = 0; i < kOddSize.pixels(); ++i) {
          if (i != damaged) {
            ASSERT_NEAR(result.ao[i], expected.ao[i], 0.05f) << "frame " << f;
            ASSERT_GE(result.tspp[i], expected.tspp[i] - 2.0f) << "frame " << f;
          } else if (f != 8) {
            ASSERT_NEAR(result.ao[i], expected.ao[i], f < 10 ? 0.8f : 0.35f) << "frame " << f;
            ASSERT_GE(result.tspp[i], 1.0f);
          }
        }
      }
    }
}

TEST(AoDenoiser, SurfacesThatWereBehindTheCameraStartAnew) {
  for (const float depth : {-3.0f, 0.0f, 1e-42f, kNan, kInfinity}) {
    AoDenoiser denoiser;
    for (uint32_t f = 0; f < 4; ++f) {
      GBuffer g = wall(kOddSize);
      for (size_t i = 0; i < kOddSize.pixels(); ++i)
        g.view_z[i] = 20.0f + 0.5f * static_cast<float>(i % kOddSize.width), g.motion_px[i] = Vec2(0.5f, 0.0f);
      g.previous_z = g.view_z;
      for (size_t i = 0; i < kOddSize.pixels(); i += 3) g.previous_z[i] = depth;
      const DenoisedAo& result = denoiser.next_frame(g, noise(kOddSize, 0.4f, f));
      expect_sound(result);
      for (size_t i = 0; i < kOddSize.pixels(); i += 3) ASSERT_EQ(result.tspp[i], 1.0f) << "previous depth " << depth;
    }
  }
}

TEST(AoDenoiser, GarbageEverywhereGivesSoundImages) {
  const float bad[] = {kNan, kInfinity, -kInfinity, 0.0f, -0.0f, 1e-45f, 3e38f, -3e38f, 1.0f, 0.5f, 12.0f};
  const auto pick = [&](uint32_t i, uint32_t c, uint32_t f) {
    return bad[static_cast<size_t>(uniform(i, c, f) * 11.0f)];
  };
  AoDenoiser denoiser;
  for (uint32_t f = 0; f < 40; ++f) {
    GBuffer g = wall(kOddSize);
    AoFrame frame = noise(kOddSize, 0.5f, f);
    for (uint32_t i = 0; i < kOddSize.pixels(); ++i) {
      g.view_z[i] = pick(i, 0, f), g.normal[i] = Vec3(pick(i, 1, f), pick(i, 2, f), pick(i, 3, f));
      g.motion_px[i] = Vec2(pick(i, 4, f), pick(i, 5, f)),
      g.instance[i] = static_cast<uint32_t>(7.0f * uniform(i, 6, f));
      frame.ao[i] = pick(i, 7, f);
    }
    const DenoisedAo& result = denoiser.next_frame(g, frame);
    expect_sound(result);
    for (size_t i = 0; i < kOddSize.pixels(); ++i)
      if (!(g.view_z[i] > 0.0f)) {
        ASSERT_EQ(result.ao[i], kInvalidAo);
      }
  }
}

std::vector<float> run_sequence(size_t threads, const char* isa = nullptr) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  if (isa != nullptr) setenv("PACKTRACE_ISA", isa, 1);
  AoDenoiser denoiser;
  std::vector<float> all_results;
  const ImageSize size{131, 400}; // more than one strip of the filter
  for (uint32_t f = 0; f < 12; ++f) {
    GBuffer g = wall(size);
    for (uint32_t i = 0; i < size.pixels(); ++i) {
      const float x = static_cast<float>(i % size.width), y = static_cast<float>(i / size.width);
      g.view_z[i] = uniform(i, 0, 0) < 0.02f ? 0.0f : 10.0f + std::sin(x * 0.2f) * std::cos(y * 0.1f);
      g.instance[i] = i / 4000;
      if (f > 2 && f < 8) g.motion_px[i] = Vec2(i % 23 < 3 ? -4.6f : 0.3f, -0.7f); // runs of 3 and 20 pixels
    }
    AoFrame frame = noise(size, 0.5f, f);
    frame.stratified = f % 4 > 1, frame.samples = f % 2 != 0 ? 4 : 1;
    const DenoisedAo& result = denoiser.next_frame(g, frame);
    for (const auto* plane : {&result.ao, &result.variance, &result.tspp})
      all_results.insert(all_results.end(), plane->begin(), plane->end());
  }
  return all_results;
}

TEST(AoDenoiser, ThreadsAndRepeatsDoNotChangeABit) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const std::vector<float> one = run_sequence(1);
  EXPECT_EQ(one, run_sequence(1));
  EXPECT_EQ(one, run_sequence(2));
  EXPECT_EQ(one, run_sequence(7));
}

TEST(AoDenoiser, InstructionSetsDoNotChangeABit) {
  const char* before = std::getenv("PACKTRACE_ISA");
  const std::string restored = before != nullptr ? before : "";
  const std::vector<float> scalar = run_sequence(2, "scalar");
  if (isa_supported(Isa::kAvx2)) {
    EXPECT_EQ(scalar, run_sequence(2, "avx2"));
  }
  if (isa_supported(Isa::kAvx512)) {
    EXPECT_EQ(scalar, run_sequence(2, "avx512"));
  }
  before != nullptr ? setenv("PACKTRACE_ISA", restored.c_str(), 1) : unsetenv("PACKTRACE_ISA");
}

TEST(AoDenoiser, CheckerboardsAreFilledAtOnceAndStayClose) {
  const ImageSize size{288, 192}; // some 300 times as large as the filter, so that RMSEs are good to 5 %
  const auto truth = [](uint32_t, uint32_t) { return expected(0.5f); };
  AoDenoiser full, half;
  for (uint32_t f = 0; f < 32; ++f) {
    const GBuffer g = wall(size);
    const DenoisedAo& all_pixels = full.next_frame(g, noise(size, 0.5f, f));
    const DenoisedAo& result = half.next_frame(g, samples(size, [&](uint32_t x, uint32_t y) {
                                                 return (x + y + f) % 2 == 0 ? noisy(0.5f, x, y, f) : kInvalidAo;
                                               }));
    for (float ao : result.ao) ASSERT_TRUE(ao >= 0.0f && ao <= 1.0f);
    // Half as many samples give sqrt(2) times the noise, or 1.5 times while some pixels have one sample and others two.
    const double most = f < 3 ? 1.6 : 1.5;
    EXPECT_LE(rmse_of(result.ao, size, all(size), truth), most * rmse_of(all_pixels.ao, size, all(size), truth)) << f;
  }
}

TEST(AoDenoiser, PixelsWithoutASampleTakeTheirSurfacesValue) {
  const GBuffer g = wall(kOddSize);
  AoDenoiser sparse, none;
  const DenoisedAo& filled = sparse.next_frame(
      g, samples(kOddSize, [](uint32_t x, uint32_t y) { return x % 7 == 0 && y % 7 == 0 ? 0.6f : kInvalidAo; }));
  for (size_t i = 0; i < kOddSize.pixels(); ++i) ASSERT_NEAR(filled.ao[i], 0.6f, 1e-6f);
  const DenoisedAo& open = none.next_frame(g, samples(kOddSize, [](uint32_t, uint32_t) { return kInvalidAo; }));
  for (size_t i = 0; i < kOddSize.pixels(); ++i) {
    ASSERT_EQ(open.ao[i], 1.0f);
    ASSERT_EQ(open.tspp[i], 0.0f);
  }
}

TEST(AoDenoiser, ResetAndResizeForgetEverything) {
  const ImageSize other{31, 50};
  AoDenoiser denoiser, fresh;
  for (uint32_t f = 0; f < 5; ++f) denoiser.next_frame(wall(kOddSize), noise(kOddSize, 0.9f, f));
  denoiser.reset();
  const DenoisedAo expected = fresh.next_frame(wall(kOddSize), noise(kOddSize, 0.2f, 9));
  const DenoisedAo& cut = denoiser.next_frame(wall(kOddSize), noise(kOddSize, 0.2f, 9));
  EXPECT_EQ(cut.ao, expected.ao);
  EXPECT_EQ(cut.tspp, std::vector<float>(kOddSize.pixels(), 1.0f));
  const DenoisedAo& resized = denoiser.next_frame(wall(other), noise(other, 0.2f, 10));
  EXPECT_EQ(resized.size, other);
  EXPECT_EQ(resized.tspp, std::vector<float>(other.pixels(), 1.0f));
}

TEST(AoDenoiser, ImagesOfAnySizeWork) {
  for (const ImageSize size : {ImageSize{0, 0}, {0, 5}, {1, 1}, {1, 40}, {40, 1}, {3, 2}, {9, 33}, {8, 64}}) {
    AoDenoiser denoiser;
    for (uint32_t f = 0; f < 3; ++f) {
      GBuffer g = wall(size);
      for (Vec2& motion : g.motion_px) motion = Vec2(f == 2 ? 0.5f : 0.0f, 0.0f);
      const DenoisedAo& result = denoiser.next_frame(g, noise(size, 0.5f, f));
      EXPECT_EQ(result.ao.size(), size.pixels());
      for (float ao : result.ao) EXPECT_TRUE(ao >= 0.0f && ao <= 1.0f);
    }
  }
}

TEST(AoDenoiser, UnchangedGBuffersAreNotReadAgain) {
  const GBuffer g = wall(kOddSize), other = wall(kOddSize, 3.0f);
  AoDenoiser compared, trusting;
  for (uint32_t f = 0; f < 6; ++f) {
    const AoFrame frame = noise(kOddSize, 0.5f, f);
    compared.add_frame(g, frame);
    trusting.add_frame(f == 0 ? g : other, frame, HistorySource::kUnchanged); // the first one is read in any case
  }
  EXPECT_EQ(compared.denoise().ao, trusting.denoise().ao);
  EXPECT_EQ(compared.save(), trusting.save());
}

TEST(AoDenoiser, ArraysOfTheWrongSizeAndNumbersOutOfRangeAreRejected) {
  const auto rejects = [](const std::function<void(GBuffer&, AoFrame&)>& change) {
    GBuffer g = wall(kOddSize);
    AoFrame frame = noise(kOddSize, 0.5f, 0);
    change(g, frame);
    AoDenoiser denoiser;
    try {
      denoiser.next_frame(g, frame);
    } catch (const Error& error) {
      return error.kind() == ErrorKind::kUsage;
    }
    return false;
  };
  EXPECT_FALSE(rejects([](GBuffer&, AoFrame&) {}));
  EXPECT_TRUE(rejects([](GBuffer& g, AoFrame&) { g.view_z.pop_back(); }));
  EXPECT_TRUE(rejects([](GBuffer& g, AoFrame&) { g.normal.clear(); }));
  EXPECT_TRUE(rejects([](GBuffer& g, AoFrame&) { g.instance.resize(1); }));
  EXPECT_TRUE(rejects([](GBuffer& g, AoFrame&) { g.motion_px.clear(); }));
  EXPECT_TRUE(rejects([](GBuffer&, AoFrame& a) { a.ao.pop_back(); }));
  EXPECT_TRUE(rejects([](GBuffer&, AoFrame& a) { a.resize({45, 67}); }));
  EXPECT_TRUE(rejects([](GBuffer&, AoFrame& a) { a.samples = 0; }));
  EXPECT_TRUE(rejects([](GBuffer&, AoFrame& a) { a.samples = 65537; }));
  EXPECT_FALSE(rejects([](GBuffer&, AoFrame& a) { a.samples = 65536; }));
}

} // namespace
} // namespace packtrace
