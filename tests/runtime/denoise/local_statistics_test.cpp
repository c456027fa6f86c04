#include "runtime/denoise/local_statistics.h"

#include <gtest/gtest.h>

#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using synthetic::uniform;

/// Reference implementation: plain sums over the window.
struct Reference {
  double count = 0, sum = 0, squares = 0, change = 0;

  Reference(const FrameSamples& s, int x, int y, int radius) {
    for (int v = y - radius; v <= y + radius; ++v)
      for (int u = x - radius; u <= x + radius; ++u) {
        const double ao = static_cast<double>(s.ao.row(v)[u]);
        count += static_cast<double>(s.valid.row(v)[u]), sum += ao, squares += ao * ao;
        change += static_cast<double>(s.change.row(v)[u]);
      }
  }
};

TEST(LocalStatistics, AreThoseOfTheSamplesInTheWindow) {
  const ImageSize size{29, 41};
  FrameSamples samples;
  samples.resize(size);
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      if (uniform(x, y, 0) < 0.5f || y > 30) continue; // some windows get no samples at all
      samples.ao.row(static_cast<int>(y))[x] = uniform(x, y, 1);
      samples.valid.row(static_cast<int>(y))[x] = 1.0f;
      samples.change.row(static_cast<int>(y))[x] = uniform(x, y, 2) - 0.5f;
    }
  for (const uint32_t window : {3u, 5u, 7u, 9u}) {
    LocalStatisticsRows rows(size.width, window);
    for (const int first : {0, 17}) {
      rows.begin(samples, first);
      for (int y = first; y < static_cast<int>(size.height); ++y) {
        const LocalStatistics& local = rows.at(samples, y);
        for (int x = 0; x < static_cast<int>(size.width); ++x) {
          const size_t i = static_cast<size_t>(x);
          const Reference wide(samples, x, y, static_cast<int>(window / 2)), narrow(samples, x, y, 1);
          ASSERT_EQ(local.count[i], wide.count);
          ASSERT_EQ(local.narrow_count[i], narrow.count);
          const double n = std::max(wide.count, 1.0), mean = wide.sum / n;
          ASSERT_NEAR(local.mean[i], mean, 1e-5);
          ASSERT_NEAR(local.change[i], wide.change / n, 1e-5);
          ASSERT_NEAR(local.narrow_change[i], narrow.change / std::max(narrow.count, 1.0), 1e-5);
          const double variance = wide.count > 1 ? (wide.squares - wide.sum * mean) / (wide.count - 1) : 0.0;
          ASSERT_NEAR(local.variance[i], variance, 1e-5) << x << ' ' << y << " window " << window;
        }
      }
    }
  }
}

} // namespace
} // namespace packtrace
