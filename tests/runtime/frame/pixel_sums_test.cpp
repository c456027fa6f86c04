#include "runtime/frame/pixel_sums.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace packtrace {
namespace {

constexpr uint32_t kWidth = 523, kHeight = 401; // several parts of sums, the last one not full

TEST(PixelSums, CountSurfacesAndTheirHistory) {
  GBuffer gbuffer;
  gbuffer.resize({kWidth, kHeight});
  DenoisedAo denoised;
  denoised.ao.assign(kWidth * kHeight, kInvalidAo), denoised.tspp.assign(kWidth * kHeight, 1e6f);
  uint64_t hits = 0;
  double frames = 0.0;
  for (size_t i = 0; i < kWidth * kHeight; i += 3, ++hits) {
    gbuffer.instance[i] = static_cast<uint32_t>(i % 7);
    denoised.ao[i] = 0.0f, denoised.tspp[i] = static_cast<float>(i % 1000);
    frames += static_cast<double>(i % 1000);
  }
  EXPECT_EQ(count_hits(gbuffer), hits);
  EXPECT_DOUBLE_EQ(mean_history(denoised), frames / static_cast<double>(hits));
}

TEST(PixelSums, NoPixels) {
  EXPECT_EQ(count_hits(GBuffer{}), 0u);
  EXPECT_EQ(mean_history(DenoisedAo{}), 0.0);
  DenoisedAo missed;
  missed.ao.assign(5, kInvalidAo), missed.tspp.assign(5, 0.0f);
  EXPECT_EQ(mean_history(missed), 0.0);
}

/// Sums of fractions depend on their order.
TEST(PixelSums, AreTheSameForAnyNumberOfThreads) {
  DenoisedAo denoised;
  denoised.ao.assign(kWidth * kHeight, 0.5f), denoised.tspp.resize(kWidth * kHeight);
  for (size_t i = 0; i < denoised.tspp.size(); ++i) denoised.tspp[i] = 1.0f / static_cast<float>(i + 1);
  const double expected = mean_history(denoised);
  for (const size_t threads : {size_t{1}, size_t{3}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    for (int repeat = 0; repeat < 20; ++repeat) EXPECT_EQ(mean_history(denoised), expected);
  }
}

} // namespace
} // namespace packtrace
