#include "runtime/denoise/local_statistics.h"

#include <gtest/gtest.h>

#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using synthetic::uniform;

struct FrameSamples {
  Plane<int32_t> value, square, change;
  void resize(ImageSize size) { value.resize(size), square.resize(size), change.resize(size); }
};

/// Reference implementation: plain sums over the window.
struct Reference {
  uint32_t value = 0;
  int32_t square = 0, change = 0;

  Reference(const FrameSamples& s, int x, int y, int radius) {
    for (int v = y - radius; v <= y + radius; ++v)
      for (int u = x - radius; u <= x + radius; ++u)
        value += static_cast<uint32_t>(s.value.row(v)[u]), square += s.square.row(v)[u], change += s.change.row(v)[u];
  }
};

/// The sum of three rows at x.
uint32_t sum_at(const std::array<const int32_t*, 3>& rows, int x) {
  return static_cast<uint32_t>(rows[0][x]) + static_cast<uint32_t>(rows[1][x]) + static_cast<uint32_t>(rows[2][x]);
}

TEST(LocalStatistics, AreThoseOfTheSamplesInTheWindow) {
  const ImageSize size{29, 41};
  FrameSamples samples;
  samples.resize(size);
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      if (y < 16 && uniform(x, y, 0) < 0.5f) continue;
      if (y > 30) continue;                              // some windows get no samples at all
      const float ao = y > 15 ? 1.0f : uniform(x, y, 1); // large sums do not reach the counts
      samples.value.row(static_cast<int>(y))[x] = static_cast<int32_t>(ao * kSampleUnits) + (1 << kCountShift);
      samples.square.row(static_cast<int>(y))[x] = static_cast<int32_t>(ao * ao * kSampleUnits);
      samples.change.row(static_cast<int>(y))[x] = static_cast<int32_t>((2 * uniform(x, y, 2) - 1) * kSampleUnits);
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
          rows.add({samples.value.row(added), samples.square.row(added), samples.change.row(added)});
        const int y = added - radius;
        if (y < first) continue;
        const WindowRow sums = rows.finish();
        for (int x = 0; x < static_cast<int>(size.width); ++x) {
          const Reference wide(samples, x, y, static_cast<int>(window / 2)), narrow(samples, x, y, 1);
          ASSERT_EQ(static_cast<uint32_t>(sums.value[x]), wide.value) << x << ' ' << y << " window " << window;
          ASSERT_EQ(sums.square[x], wide.square);
          ASSERT_EQ(sums.change[x], wide.change);
          ASSERT_EQ(sum_at(sums.narrow_value, x), narrow.value);
          ASSERT_EQ(sum_at(sums.narrow_change, x), static_cast<uint32_t>(narrow.change));
        }
      }
    }
  }
}

} // namespace
} // namespace packtrace
