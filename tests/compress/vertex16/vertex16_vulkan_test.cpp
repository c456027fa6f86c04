#include <array>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "compress/exchange/vertex16/vertex16_decode.h"
#include "tests/compress/test_scenes.h"
#include "tests/compress/vertex16/vulkan_compute.h"

namespace packtrace {
namespace {

using namespace vertex16;

constexpr uint32_t kBatch = 1u << 18, kBatches = 16; // 4 M vertices

/// Random bits; the normals include all codes, the flat one, and numbers that are no codes.
std::vector<glm::uvec4> random_vertices(test::Random& random) {
  std::vector<glm::uvec4> vertices(kBatch);
  for (glm::uvec4& v : vertices) v = {random.bits(), random.bits(), random.bits(), random.bits()};
  vertices[0].z |= 0xffffffu;
  return vertices;
}

Vertex16Frame random_frame(test::Random& random) {
  Vertex16Frame frame;
  const auto origin = [&](uint32_t bits) {
    return static_cast<int32_t>(random.bits() & ((1u << bits) - 1)) - (1 << (bits - 1));
  };
  frame.origin = {origin(24), origin(24), origin(24)};
  frame.step = std::ldexp(static_cast<float>(8 + random.bits() % 8), static_cast<int>(random.bits() % 40) - 20);
  frame.uv_origin = {origin(24), origin(24)};
  frame.uv_step = {std::ldexp(1.0f, -static_cast<int>(random.bits() % 20)), 0x1p-16f};
  return frame;
}

TEST(Vertex16Vulkan, TheShaderDecodesWhatTheHeaderDoes) {
  const std::unique_ptr<test::VulkanCompute> gpu = test::VulkanCompute::create(PACKTRACE_VERTEX16_SPIRV, 3);
  if (!gpu) GTEST_SKIP() << "no Vulkan device";
  RecordProperty("device", gpu->device());
  test::Random random(16);
  float largest = 0.0f;
  for (uint32_t batch = 0; batch < kBatches; ++batch) {
    const std::vector<glm::uvec4> vertices = random_vertices(random);
    const Vertex16Frame frame = random_frame(random);
    const std::array<std::span<const std::byte>, 2> inputs{std::as_bytes(std::span(vertices)),
                                                           std::as_bytes(std::span(&frame, 1))};
    const std::vector<std::byte> bytes = gpu->run(inputs, vertices.size() * 12 * sizeof(float), kBatch);
    for (size_t i = 0; i < vertices.size(); ++i) {
      std::array<float, 12> got;
      std::memcpy(got.data(), bytes.data() + i * sizeof got, sizeof got);
      const vec3 position = vertex16_position(vertices[i], frame), normal = vertex16_decode_normal(vertices[i]);
      const vec2 uv = vertex16_uv(vertices[i], frame);
      // Exact by construction: one product, and no rounding before it.
      ASSERT_EQ(vec3(got[0], got[1], got[2]), position) << i;
      ASSERT_EQ(vec2(got[6], got[7]), uv) << i;
      const vec4 tangent = vertex16_tangent(vertices[i], normal);
      for (int c = 0; c < 3; ++c) {
        const auto at = static_cast<size_t>(c);
        largest = std::max({largest, std::abs(got[3 + at] - normal[c]), std::abs(got[8 + at] - tangent[c])});
      }
      ASSERT_EQ(got[11], tangent.w) << i;
    }
  }
  EXPECT_LE(largest, 4e-6f); // 0.0003 degrees: devices differ in square roots, divisions and fused operations
  std::printf("%s: normals and tangents of %u vertices within %g\n", gpu->device().c_str(), kBatch * kBatches,
              static_cast<double>(largest));
}

} // namespace
} // namespace packtrace
