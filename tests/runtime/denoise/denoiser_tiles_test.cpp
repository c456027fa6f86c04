#include "runtime/denoise/denoiser.h"

#include <gtest/gtest.h>

#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using namespace synthetic;

/// Wide enough for two columns of the filter's tiles, and high enough for two rows of them and four strips of history.
constexpr ImageSize kImage{1600, 420};
/// A part of the image around the corner of four tiles; by itself it is one tile.
constexpr Rect kPart{500, 90, 1100, 300};

/// Bumps with some holes, in motion by a quarter of a pixel, which is exact at all columns.
GBuffer bumps(ImageSize size, Rect part) {
  GBuffer g;
  g.resize(size);
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      const size_t i = static_cast<size_t>(y) * size.width + x;
      const float u = static_cast<float>(part.x0 + x), v = static_cast<float>(part.y0 + y);
      if (uniform(part.x0 + x, part.y0 + y, 100) < 0.01f) continue;
      g.view_z[i] = 10.0f + std::sin(u * 0.2f) * std::cos(v * 0.1f);
      g.normal[i] = Vec3(0, 0, -1), g.instance[i] = static_cast<uint32_t>(u + v) / 64;
      g.motion_px[i] = Vec2(0.25f, 0.0f);
    }
  return g;
}

DenoisedAo denoised(ImageSize size, Rect part) {
  AoDenoiser denoiser;
  const GBuffer g = bumps(size, part);
  DenoisedAo result;
  for (uint32_t f = 0; f < 3; ++f)
    result = denoiser.next_frame(
        g, samples(size, [&](uint32_t x, uint32_t y) { return noisy(0.5f, part.x0 + x, part.y0 + y, f); }));
  return result;
}

TEST(AoDenoiser, TilesAndStripsDoNotShow) {
  const DenoisedAo whole = denoised(kImage, all(kImage));
  const ImageSize size{kPart.x1 - kPart.x0, kPart.y1 - kPart.y0};
  const DenoisedAo part = denoised(size, kPart);
  constexpr uint32_t kMargin = 48; // farther than the part's edges have an effect in three frames
  for (uint32_t y = kMargin; y < size.height - kMargin; ++y)
    for (uint32_t x = kMargin; x < size.width - kMargin; ++x) {
      const size_t i = static_cast<size_t>(y) * size.width + x;
      const size_t j = static_cast<size_t>(kPart.y0 + y) * kImage.width + kPart.x0 + x;
      ASSERT_EQ(part.ao[i], whole.ao[j]) << x << ' ' << y;
      ASSERT_EQ(part.variance[i], whole.variance[j]);
      ASSERT_EQ(part.tspp[i], whole.tspp[j]);
    }
}

} // namespace
} // namespace packtrace
