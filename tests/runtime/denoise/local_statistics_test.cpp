#include "runtime/denoise/local_statistics.h"

#include <gtest/gtest.h>

#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using synthetic::uniform;

struct FrameSamples {
  Plane<float> ao, valid, change;
  void resize(ImageSize size) { ao.resize(size), valid.resize(size), change.resize(size); }
};

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
    LocalStatisticsRows rows(size.width, window, history_kernels(chosen_isa()));
    for (const int first : {0, 17}) {
      const int height = static_cast<int>(size.height), radius = rows.radius();
      ASSERT_EQ(radius, static_cast<int>(window / 2));
      for (int added = first - radius; added < height + radius; ++added) {
        if (added < 0 || added >= height)
          rows.add_nothing();
        else
          rows.add({samples.ao.row(added), samples.valid.row(added), samples.change.row(added)});
        const int y = added - radius;
        if (y < first) continue;
        const WindowSums sums = rows.finish();
        for (int x = 0; x < static_cast<int>(size.width); ++x) {
          const Reference wide(samples, x, y, static_cast<int>(window / 2)), narrow(samples, x, y, 1);
          ASSERT_EQ(sums.count[x], wide.count);
          ASSERT_EQ(sums.narrow_count[x], narrow.count);
          ASSERT_NEAR(sums.sum[x], wide.sum, 1e-5) << x << ' ' << y << " window " << window;
          ASSERT_NEAR(sums.squares[x], wide.squares, 1e-5);
          ASSERT_NEAR(sums.change[x], wide.change, 1e-5);
          ASSERT_NEAR(sums.narrow_change[x], narrow.change, 1e-5);
        }
      }
    }
  }
}

} // namespace
} // namespace packtrace
