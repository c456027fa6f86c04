#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "compress/exchange/shader/image_shader.h"
#include "compress/exchange/shader/shader_image.h"
#include "compress/format/textures/texture_encoder.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

template <class Color>
AlbedoTexture picture(uint32_t width, uint32_t height, const Color& color) {
  AlbedoTexture result;
  result.width = width, result.height = height;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const Rgb8 c = color(x, y);
      result.rgb.insert(result.rgb.end(), c.begin(), c.end());
    }
  return result;
}

uint8_t byte(double value) { return static_cast<uint8_t>(std::lrint(std::clamp(value, 0.0, 255.0))); }

/// Soft shapes of two colours.
AlbedoTexture waves(uint32_t width, uint32_t height) {
  return picture(width, height, [](uint32_t x, uint32_t y) {
    const double v = 0.5 + 0.25 * std::sin(x * 0.11) + 0.25 * std::cos(y * 0.07 + x * 0.03);
    return Rgb8{byte(20 + 200 * v), byte(10 + 180 * v), byte(60 + 80 * v)};
  });
}

TEST(ShaderImage, GreyValuesLieOnTheCurveExactly) {
  const AlbedoTexture greys = picture(256, 2, [](uint32_t x, uint32_t) {
    return Rgb8{static_cast<uint8_t>(x), static_cast<uint8_t>(x), static_cast<uint8_t>(x)};
  });
  EXPECT_LE(difference_of(encode_shader_image(greys, TexelFormat::kGrey), greys).max_error, 1u);
}

TEST(ShaderImage, ACurveOfColoursIsFound) {
  const AlbedoTexture source = waves(90, 70); // on a line of colours, from 1 byte a texel
  const ImageDifference grey = difference_of(encode_shader_image(source, TexelFormat::kGrey), source);
  EXPECT_GT(grey.psnr_db, 45.0);
  // Each colour follows another law of brightness: a straight line between two colours would miss by far.
  const AlbedoTexture bent = picture(128, 32, [](uint32_t x, uint32_t y) {
    const double v = (x + y) / 160.0;
    return Rgb8{byte(255 * v * v), byte(255 * v), byte(255 * (1 - v) * v * 4)};
  });
  EXPECT_GT(difference_of(encode_shader_image(bent, TexelFormat::kGrey), bent).psnr_db, 38.0);
}

TEST(ShaderImage, R2G4B2EqualsTheTextureCodec) {
  const AlbedoTexture source = waves(33, 17);
  const ShaderImage image = encode_shader_image(source, TexelFormat::kR2G4B2);
  const EncodedTexture coded = encode_texture(source, TextureCodec::kR2G4B2, 0.0);
  TextureView view = packtrace::view(source);
  view.codec = coded.codec, view.data = coded.data;
  for (uint32_t y = 0; y < source.height; ++y)
    for (uint32_t x = 0; x < source.width; ++x) ASSERT_EQ(image.texel(x, y), view.texel(x, y));
  EXPECT_NEAR(difference_of(image, source).psnr_db, coded.psnr_db, 1e-9);
}

TEST(ShaderImage, FilteredBitsShowSoftShapes) {
  const AlbedoTexture source = waves(120, 90);
  const double bits = difference_of(encode_shader_image(source, TexelFormat::kBit), source).psnr_db;
  EXPECT_GT(bits, 27.0); // error diffusion without search: about 20
  // A plain picture needs its colour only; one of two colours is kept where the shapes are larger than the filter.
  const AlbedoTexture plain = picture(7, 5, [](uint32_t, uint32_t) { return Rgb8{9, 200, 31}; });
  EXPECT_EQ(difference_of(encode_shader_image(plain, TexelFormat::kBit), plain).max_error, 0u);
  const AlbedoTexture halves =
      picture(40, 40, [](uint32_t x, uint32_t) { return x < 20 ? Rgb8{0, 0, 0} : Rgb8{255, 240, 10}; });
  const ShaderImage image = encode_shader_image(halves, TexelFormat::kBit);
  // The filter blurs the edge; the keys overshoot slightly to compensate.
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(image.texel(0, 0)[c], 0, 5);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(image.texel(39, 39)[c], (Rgb8{255, 240, 10})[c], 5);
}

TEST(ShaderImage, BitsShowALittleInk) {
  for (const bool inverse : {false, true}) {
    const auto ink = [&](uint32_t x, uint32_t y) { return (x >= 20 && x < 30 && y >= 30 && y < 34) != inverse; };
    const AlbedoTexture source = picture(64, 64, [&](uint32_t x, uint32_t y) { // 1 % differs
      return ink(x, y) ? Rgb8{20, 10, 30} : Rgb8{250, 245, 240};
    });
    const ShaderImage image = encode_shader_image(source, TexelFormat::kBit);
    EXPECT_GT(difference_of(image, source).psnr_db, 25.0); // without ink: 20
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(image.texel(25, 32)[c], source.rgb[3 * (32 * 64 + 25) + c], 30);
      EXPECT_NEAR(image.texel(5, 5)[c], source.rgb[3 * (5 * 64 + 5) + c], 10);
    }
  }
}

TEST(ShaderImage, EverySizeAndFormatIsEncodedTheSameTwice) {
  for (const auto& [w, h] : {std::pair{1u, 1u}, {1u, 9u}, {33u, 1u}, {31u, 3u}})
    for (const TexelFormat format : {TexelFormat::kBit, TexelFormat::kGrey, TexelFormat::kR2G4B2}) {
      const AlbedoTexture source = waves(w, h);
      const ShaderImage image = encode_shader_image(source, format);
      EXPECT_EQ(image.words.size() + image.ramp.size(), shader_image_elements(format, w, h));
      EXPECT_EQ(image.words, encode_shader_image(source, format).words);
      EXPECT_LT(difference_of(image, source).max_error, 128u);
    }
}

TEST(ShaderImage, TheLargestSideFitsAndTheNextDoesNot) {
  for (const TexelFormat format : {TexelFormat::kBit, TexelFormat::kGrey, TexelFormat::kR2G4B2})
    for (const auto& [w, h] : {std::pair{4000u, 3000u}, {300u, 16000u}, {9000u, 1u}})
      for (const uint64_t limit : {18u, 1024u, 4096u}) {
        const uint32_t side = largest_image_side(format, w, h, limit);
        ASSERT_GT(side, 0u);
        const auto elements = [&](uint32_t longest) {
          const auto [sw, sh] = scaled_size(w, h, longest);
          return shader_image_elements(format, sw, sh);
        };
        EXPECT_LE(elements(side), limit);
        EXPECT_TRUE(side == std::max(w, h) || elements(side + 1) > limit) << side;
      }
  EXPECT_EQ(largest_image_side(TexelFormat::kGrey, 10, 10, 17), 0u); // the curve alone takes as many
}

TEST(ShaderImage, LargerImagesAreAveragedInLinearLight) {
  const AlbedoTexture checks =
      picture(8, 4, [](uint32_t x, uint32_t y) { return (x + y) % 2 != 0 ? Rgb8{255, 255, 255} : Rgb8{0, 0, 0}; });
  const AlbedoTexture half = scaled_down(checks, 4);
  ASSERT_EQ(half.width, 4u);
  ASSERT_EQ(half.height, 2u);
  for (const uint8_t value : half.rgb) EXPECT_EQ(value, 188); // half the light
  // Parts of texels count by their area: 2/3 white and 1/3 black.
  const AlbedoTexture three = picture(3, 1, [](uint32_t x, uint32_t) { return x == 1 ? Rgb8{} : Rgb8{255, 255, 255}; });
  const AlbedoTexture two = scaled_down(three, 2);
  EXPECT_EQ(two.rgb, std::vector<uint8_t>(6, srgb8_of_linear(2.0f / 3.0f)));
}

TEST(ShaderImage, TheLimitOfElementsIsKept) {
  const ShaderImage image = encode_shader_image(waves(20, 20), TexelFormat::kGrey);
  EXPECT_NO_THROW(image_shader(image, {ShaderForm::kShadertoy, 117}));
  EXPECT_THROW(image_shader(image, {ShaderForm::kShadertoy, 116}), Error);
}

} // namespace
} // namespace packtrace
