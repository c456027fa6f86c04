#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/exchange/shader/voxel_shader.h"
#include "compress/format/voxels/proxy_section.h"
#include "pbrt_import/base/error.h"
#include "runtime/ao/hash.h"
#include "runtime/image/png.h"
#include "runtime/voxels/voxel_tracer.h"
#include "tests/compress/test_scenes.h"
#include "tests/runtime/voxels/shader_harness.h"

namespace packtrace {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;

Proxy proxy_of(BakeConfig config, uint32_t voxels) {
  Scene scene = test::scene_of(test::sphere_mesh(40));
  test::add_shape(scene, test::soup_mesh(40, 3), test::scaling(DVec3(1.3, 1.2, 1.4)));
  scene.materials[0].albedo = Vec3(0.7f, 0.3f, 0.2f);
  config.proxy.use = ProxyUse::kVoxels;
  config.proxy.voxels = voxels;
  const BakedFile file = BakedFile::from_bytes(test::bake(scene, config).bytes);
  return read_proxies(proxy_bytes(file)).back();
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
    for (int i = 0; i < 3; ++i) albedo[i] = linear_from_srgb(static_cast<float>(c >> (8 * i) & 0xffu) / 255.0f);
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
  EXPECT_GT(hits, kWidth * kHeight / 6);
  EXPECT_LE(static_cast<double>(different), 0.001 * kWidth * kHeight);
  std::printf("%llu of %u pixels differ\n", static_cast<unsigned long long>(different), kWidth * kHeight);
}

TEST(VoxelShader, ShowsWhatTheCpuTracesForEveryFormOfStream) {
  BakeConfig config;
  compare_with_cpu(proxy_of(config, 30));
  config.proxy.fill = true;
  config.proxy.dag = true;
  compare_with_cpu(proxy_of(config, 64));
  config.proxy.dag = false;
  config.proxy.materials = true;
  compare_with_cpu(proxy_of(config, 40));
}

TEST(VoxelShader, BothFormsCompile) {
  const TemporaryFolder folder;
  BakeConfig config;
  config.proxy.materials = true;
  const Proxy proxy = proxy_of(config, 24);
  const ShaderView view = shader_view(proxy.voxels.size(), 1);
  EXPECT_TRUE(test::compile_glsl(folder.path(), voxel_shader(proxy, view, {ShaderForm::kGlsl450, 4096}), "frag",
                                 folder.path() / "fragment.spv"));
  EXPECT_TRUE(test::compile_glsl(
      folder.path(), test::shadertoy_program(voxel_shader(proxy, view, {ShaderForm::kShadertoy, 4096})), "frag", {}));
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
