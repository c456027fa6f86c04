#include <array>
#include <cmath>
#include <cstring>
#include <regex>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/exchange/shader/voxel_shader.h"
#include "pbrt_import/base/error.h"
#include "runtime/ao/hash.h"
#include "runtime/voxels/voxel_tracer.h"
#include "tests/runtime/voxels/shader_harness.h"

namespace packtrace {
namespace {

constexpr uint32_t kWidth = 96, kHeight = 72;

/// A ball with loose voxels around it.
Proxy proxy_of(OccupancyOptions options, uint32_t voxels, uint32_t colors = 0) {
  VoxelSet set({voxels, voxels, voxels - 3});
  uint32_t state = 5;
  for (uint32_t z = 0; z < set.size()[2]; ++z)
    for (uint32_t y = 0; y < voxels; ++y)
      for (uint32_t x = 0; x < voxels; ++x) {
        const float d = glm::distance(Vec3(x, y, z), Vec3(0.5f * static_cast<float>(voxels)));
        if (d < 0.35f * static_cast<float>(voxels) || hash32(state++) % 100 == 0) set.set({x, y, z});
      }
  std::vector<uint8_t> swatches;
  Proxy proxy;
  if (colors > 0) {
    for (uint64_t i = 0; i < set.count(); ++i) swatches.push_back(static_cast<uint8_t>(hash32(state++) % colors));
    for (uint32_t i = 0; i < colors; ++i) proxy.palette.push_back(hash32(i) & 0xffffffu);
    options.swatches = swatches, options.palette_count = colors;
  }
  proxy.voxels = encode_occupancy(set, options);
  return proxy;
}

float linear_from_byte(uint32_t byte) {
  const double c = static_cast<double>(byte) / 255.0;
  return static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
}

Vec3 expected_color(const Proxy& proxy, const ShaderView& view, uint32_t x, uint32_t y) {
  const VoxelTracer tracer(proxy.voxels);
  const Vec2 uv = (Vec2(x, y) + 0.5f - 0.5f * Vec2(kWidth, kHeight)) / float(kHeight);
  const Vec3 direction = view.forward + uv.x * view.right + uv.y * view.up;
  const auto hit = tracer.first_hit(view.eye, direction, 0.0f, 1e30f);
  if (!hit) return glm::sqrt(view.background);
  const int axis = hit->axis < 0 ? 2 : hit->axis;
  const float side = direction[axis] > 0.0f ? -1.0f : 1.0f;
  Vec3 p = view.eye + hit->t * direction;
  p[axis] = static_cast<float>(hit->voxel[static_cast<size_t>(axis)] + (side > 0.0f ? 1 : 0)) + side * 0.015625f;
  const uint32_t h = hash32(y * 65536u + x);
  int open = 0;
  for (Vec3 local : view.directions) {
    if ((h & 1) != 0) local.x = -local.x;
    if ((h & 2) != 0) local.y = -local.y;
    if ((h & 4) != 0) std::swap(local.x, local.y);
    Vec3 way;
    way[axis] = side * local.z, way[(axis + 1) % 3] = local.x, way[(axis + 2) % 3] = local.y;
    open += !tracer.first_hit(p, way, 0.0f, view.ao_radius);
  }
  Vec3 albedo = view.albedo;
  if (!proxy.palette.empty()) {
    const uint32_t c = proxy.palette[proxy.voxels.swatch(hit->voxel)];
    for (int i = 0; i < 3; ++i) albedo[i] = linear_from_byte(c >> (8 * i) & 0xffu);
  }
  return glm::sqrt(albedo * (static_cast<float>(open) / 16.0f));
}

void compare_with_cpu(const Proxy& proxy) {
  const TemporaryFolder folder;
  const ShaderView view = shader_view(proxy.voxels.size(), 1);
  const std::string text = voxel_shader(proxy, view, {ShaderForm::kGlsl450, 1u << 16});
  const std::vector<float> pixels = test::render_shader(folder.path(), text, kWidth, kHeight);
  if (pixels.empty()) GTEST_SKIP() << "no Vulkan device";
  uint64_t different = 0, hits = 0;
  for (uint32_t y = 0; y < kHeight; ++y)
    for (uint32_t x = 0; x < kWidth; ++x) {
      const Vec3 expected = expected_color(proxy, view, x, y);
      const float* const got = &pixels[4 * (size_t{y} * kWidth + x)];
      float difference = 0.0f;
      for (int c = 0; c < 3; ++c) difference = std::max(difference, std::abs(expected[c] - got[c]));
      different += !(difference < 0.5f / 255.0f);
      hits += expected != glm::sqrt(view.background);
    }
  EXPECT_GT(hits, kWidth * kHeight / 10);
  EXPECT_LE(static_cast<double>(different), 0.001 * kWidth * kHeight);
  std::printf("%llu of %u pixels differ\n", static_cast<unsigned long long>(different), kWidth * kHeight);
}

TEST(VoxelShader, ShowsWhatTheCpuTracesForEveryFormOfStream) {
  OccupancyOptions options;
  compare_with_cpu(proxy_of(options, 30));
  compare_with_cpu(proxy_of(options, 24, 20));
  options.full = true;
  options.dag = true;
  options.levels = 5;
  compare_with_cpu(proxy_of(options, 40));
}

TEST(VoxelShader, BothFormsCompile) {
  const TemporaryFolder folder;
  const Proxy proxy = proxy_of({}, 24, 7);
  const ShaderView view = shader_view(proxy.voxels.size(), 1);
  EXPECT_TRUE(test::compile_glsl(folder.path(), voxel_shader(proxy, view, {ShaderForm::kGlsl450, 4096}), "frag",
                                 folder.path() / "fragment.spv"));
  EXPECT_TRUE(test::compile_glsl(
      folder.path(), test::shadertoy_program(voxel_shader(proxy, view, {ShaderForm::kShadertoy, 4096})), "frag", {}));
}

TEST(VoxelShader, EveryEntryOfEveryArrayIsAnElement) {
  for (const uint32_t colors : {0u, 7u}) {
    const Proxy proxy = proxy_of({}, 24, colors);
    const std::string text = voxel_shader(proxy, shader_view(proxy.voxels.size(), 1), {ShaderForm::kShadertoy, 4096});
    uint64_t sum = 0;
    const std::regex array("ARRAY \\w+ \\w+\\[(\\d+)\\]");
    for (std::sregex_iterator at(text.begin(), text.end(), array), end; at != end; ++at) sum += std::stoull((*at)[1]);
    EXPECT_EQ(shader_elements(proxy), sum);
    EXPECT_GT(sum, proxy.voxels.words().size() + kShaderAoRays + colors);
  }
}

TEST(VoxelShader, TheLimitOfElementsIsKept) {
  const Proxy proxy = proxy_of({}, 24);
  const auto elements = static_cast<uint32_t>(shader_elements(proxy));
  const ShaderView view = shader_view(proxy.voxels.size(), 1);
  EXPECT_NO_THROW(voxel_shader(proxy, view, {ShaderForm::kShadertoy, elements}));
  EXPECT_THROW(voxel_shader(proxy, view, {ShaderForm::kShadertoy, elements - 1}), Error);
}

} // namespace
} // namespace packtrace
