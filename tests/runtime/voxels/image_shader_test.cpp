#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/exchange/shader/image_shader.h"
#include "runtime/ao/hash.h"
#include "tests/runtime/voxels/shader_harness.h"

namespace packtrace {
namespace {

constexpr uint32_t kImageWidth = 90, kImageHeight = 60;

/// Shapes with noise, so that neighbouring texels differ in all channels.
AlbedoTexture noisy_picture(uint32_t width, uint32_t height) {
  AlbedoTexture source;
  source.width = width, source.height = height;
  for (uint32_t i = 0; i < width * height; ++i)
    for (uint32_t c = 0; c < 3; ++c)
      source.rgb.push_back(static_cast<uint8_t>((i % width * 200 / width + hash32(3 * i + c) % 56)));
  return source;
}

/// What image_shader() shows at a pixel, from the decoder of the CPU. Row 0 is below.
Vec3 expected_texels(const ShaderImage& image, uint32_t x, uint32_t y) {
  const Vec2 size(image.width, image.height), resolution(kImageWidth, kImageHeight), scales = resolution / size;
  const Vec2 from_middle = (Vec2(x, y) + 0.5f - 0.5f * resolution) / std::min(scales.x, scales.y);
  const Vec2 place = 0.5f * size + Vec2(from_middle.x, -from_middle.y);
  if (place.x < 0.0f || place.y < 0.0f || place.x >= size.x || place.y >= size.y) return Vec3(0.0f);
  const Vec2 low = glm::floor(place - 0.5f), part = place - 0.5f - low;
  const auto color = [&](int i, int j) {
    const auto column = std::clamp(static_cast<int>(low.x) + i, 0, static_cast<int>(image.width) - 1),
               row = std::clamp(static_cast<int>(low.y) + j, 0, static_cast<int>(image.height) - 1);
    const Rgb8 c = image.texel(static_cast<uint32_t>(column), static_cast<uint32_t>(row));
    return Vec3(c[0], c[1], c[2]) / 255.0f;
  };
  return glm::mix(glm::mix(color(0, 0), color(1, 0), part.x), glm::mix(color(0, 1), color(1, 1), part.x), part.y);
}

class ImageShader : public testing::TestWithParam<TexelFormat> {};

TEST_P(ImageShader, ShowsWhatTheCpuDecodes) {
  for (const auto& [w, h] : {std::pair{31u, 21u}, {7u, 30u}, {45u, 20u}}) {
    const TemporaryFolder folder;
    const ShaderImage image = encode_shader_image(noisy_picture(w, h), GetParam());
    const std::vector<float> pixels = test::render_shader(
        folder.path(), image_shader(image, {ShaderForm::kGlsl450, 1u << 16}), kImageWidth, kImageHeight);
    if (pixels.empty()) GTEST_SKIP() << "no Vulkan device";
    uint32_t different = 0, shown = 0;
    for (uint32_t y = 0; y < kImageHeight; ++y)
      for (uint32_t x = 0; x < kImageWidth; ++x) {
        const Vec3 expected = expected_texels(image, x, y);
        const float* const got = &pixels[4 * (size_t{y} * kImageWidth + x)];
        float difference = 0.0f;
        for (int c = 0; c < 3; ++c) difference = std::max(difference, std::abs(expected[c] - got[c]));
        different += !(difference < 0.5f / 255.0f);
        shown += expected != Vec3(0.0f);
      }
    EXPECT_GT(shown, kImageWidth * kImageHeight / 8);
    EXPECT_LE(different, kImageWidth * kImageHeight / 1000);
    std::printf("%u of %u pixels differ\n", different, kImageWidth * kImageHeight);
  }
}

TEST_P(ImageShader, BothFormsCompile) {
  const TemporaryFolder folder;
  const ShaderImage image = encode_shader_image(noisy_picture(19, 11), GetParam());
  EXPECT_TRUE(test::compile_glsl(folder.path(), image_shader(image, {ShaderForm::kGlsl450, 4096}), "frag",
                                 folder.path() / "fragment.spv"));
  EXPECT_TRUE(test::compile_glsl(
      folder.path(), test::shadertoy_program(image_shader(image, {ShaderForm::kShadertoy, 4096})), "frag", {}));
}

INSTANTIATE_TEST_SUITE_P(EveryFormat, ImageShader,
                         testing::Values(TexelFormat::kBit, TexelFormat::kGrey, TexelFormat::kR2G4B2),
                         [](const auto& instance) {
                           return std::string(kTexelFormatNames[static_cast<size_t>(instance.param)]);
                         });

} // namespace
} // namespace packtrace
