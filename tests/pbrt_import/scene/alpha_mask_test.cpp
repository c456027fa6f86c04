#include "pbrt_import/scene/alpha_mask.h"

#include <limits>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

/// A mask of width x height texels that is opaque where `opaque(x, y)` is true; row 0 is the top.
template <typename Opaque>
AlphaMask make_mask(uint32_t width, uint32_t height, WrapMode wrap, Opaque opaque) {
  AlphaMask mask{width, height, wrap, Vec2(1), Vec2(0), {}};
  mask.words.resize(size_t{height} * AlphaMask::row_words(width));
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      if (opaque(x, y)) mask.words[size_t{y} * AlphaMask::row_words(width) + x / 32] |= 1u << (x % 32);
  return mask;
}

/// uv of the centre of a texel.
Vec2 centre(const AlphaMask& mask, uint32_t x, uint32_t y) {
  return {(static_cast<float>(x) + 0.5f) / static_cast<float>(mask.width),
          1.0f - (static_cast<float>(y) + 0.5f) / static_cast<float>(mask.height)};
}

TEST(AlphaMask, TexelCentresSeeTheirTexelAlone) {
  const AlphaMask mask =
      make_mask(64, 16, WrapMode::kRepeat, [](uint32_t x, uint32_t y) { return (x * 7 + y * 5) % 3 == 0; });
  for (uint32_t y = 0; y < mask.height; ++y)
    for (uint32_t x = 0; x < mask.width; ++x)
      EXPECT_EQ(view(mask).opaque(centre(mask, x, y)), (x * 7 + y * 5) % 3 == 0) << x << ' ' << y;
}

TEST(AlphaMask, TheTopRowIsAtVOne) {
  const AlphaMask mask = make_mask(4, 4, WrapMode::kClamp, [](uint32_t, uint32_t y) { return y == 0; });
  EXPECT_TRUE(view(mask).opaque({0.5f, 0.95f}));
  EXPECT_FALSE(view(mask).opaque({0.5f, 0.05f}));
}

TEST(AlphaMask, IsTransparentOnlyWhereTheWholeBilinearFootprintIsZero) {
  const AlphaMask mask = make_mask(8, 8, WrapMode::kClamp, [](uint32_t x, uint32_t y) { return x == 3 && y == 3; });
  const Vec2 texel = centre(mask, 3, 3);
  for (const float dx : {-0.9f, 0.0f, 0.9f})
    for (const float dy : {-0.9f, 0.0f, 0.9f})
      EXPECT_TRUE(view(mask).opaque(texel + Vec2(dx, dy) / 8.0f)) << dx << ' ' << dy;
  for (const float d : {-1.1f, 1.1f}) {
    EXPECT_FALSE(view(mask).opaque(texel + Vec2(d, 0) / 8.0f));
    EXPECT_FALSE(view(mask).opaque(texel + Vec2(0, d) / 8.0f));
  }
}

TEST(AlphaMask, WrapModesDifferOutsideTheUnitSquare) {
  const auto left_column = [](uint32_t x, uint32_t) { return x == 0; };
  // Texel centres one image to the right and one to the left of the unit square.
  const auto at = [&](WrapMode wrap, float u) { return view(make_mask(4, 4, wrap, left_column)).opaque({u, 0.5f}); };
  EXPECT_TRUE(at(WrapMode::kRepeat, 1.125f));
  EXPECT_FALSE(at(WrapMode::kClamp, 1.125f));
  EXPECT_FALSE(at(WrapMode::kBlack, 1.125f));
  EXPECT_FALSE(at(WrapMode::kRepeat, -0.125f));
  EXPECT_TRUE(at(WrapMode::kClamp, -0.375f));
  EXPECT_FALSE(at(WrapMode::kBlack, -0.375f));
}

TEST(AlphaMask, ScaleAndOffsetMapUvToTheImage) {
  AlphaMask mask = make_mask(4, 1, WrapMode::kRepeat, [](uint32_t x, uint32_t) { return x == 2; });
  mask.uv_scale = Vec2(0.5f, 1.0f);
  mask.uv_offset = Vec2(0.25f, 0.0f);
  EXPECT_TRUE(view(mask).opaque({0.75f, 0.5f})); // s = 0.625, the centre of texel 2
  EXPECT_FALSE(view(mask).opaque({0.0f, 0.5f}));
}

TEST(AlphaMask, CoordinatesThatNameNoTexelAreOpaque) {
  const AlphaMask mask = make_mask(4, 4, WrapMode::kRepeat, [](uint32_t, uint32_t) { return false; });
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f, -1e30f}) {
    EXPECT_TRUE(view(mask).opaque({bad, 0.5f})) << bad;
    EXPECT_TRUE(view(mask).opaque({0.5f, bad})) << bad;
  }
  EXPECT_FALSE(view(mask).opaque({1e6f, -1e6f}));
}

} // namespace
} // namespace packtrace
