#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/source/packed_source.h"
#include "runtime/voxels/proxy_choice.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

constexpr uint32_t kSide = 24;

/// Balls of radius 1 in a row away from the eye: every third has few triangles, the others 3,480.
BakedFile mixed_balls(uint32_t count, ProxyUse use) {
  Scene scene;
  scene.materials.emplace_back();
  scene.meshes.push_back(test::sphere_mesh(30));
  scene.meshes.push_back(test::sphere_mesh(8));
  scene.objects.push_back({"ball", {Shape{0, 0, false, DAffine(1.0)}}});
  scene.objects.push_back({"coarse ball", {Shape{1, 0, false, DAffine(1.0)}}});
  for (uint32_t i = 0; i < count; ++i)
    scene.instances.push_back({i % 3 == 2 ? 1u : 0u, Affine(test::translation(DVec3(i % 3, 0.0, 6.0 * (i + 1))))});
  BakeConfig config;
  config.proxy.use = use, config.proxy.voxels = kSide;
  return BakedFile::from_bytes(test::bake(scene, config).bytes);
}

/// Looks from the file's zero along z.
PrimaryCamera camera_of(const BakedFile& file) {
  Camera camera;
  camera.world_from_camera = test::translation(-file.origin());
  camera.fov_degrees = 60.0;
  return {camera, ImageSize{100, 100}};
}

uint32_t triangles_of(const BakedFile& file, const PackedSource& source, uint32_t instance) {
  return file.geometries()[source.instances()[instance].geometry].triangle_count;
}

TEST(ProxyChoice, InstancesThatLookSmallAreChosenByTheirDistance) {
  const BakedFile file = mixed_balls(40, ProxyUse::kVoxels);
  const PackedSource source(file);
  const ProxyChoice choice(file);
  const std::vector<uint32_t> small = choice.small_instances(source, camera_of(file), 8.0),
                              all = choice.small_instances(source, camera_of(file), 1e6);
  ASSERT_GT(small.size(), 3u);
  ASSERT_LT(small.size(), 25u);
  EXPECT_TRUE(std::ranges::is_sorted(small));
  EXPECT_TRUE(std::ranges::equal(small, std::vector<uint32_t>(all.end() - static_cast<std::ptrdiff_t>(small.size()),
                                                              all.end()))); // the far ones
}

TEST(ProxyChoice, GeometriesOfFewTrianglesStayTriangles) {
  const BakedFile file = mixed_balls(30, ProxyUse::kVoxels);
  const PackedSource source(file);
  const std::vector<uint32_t> small = ProxyChoice(file).small_instances(source, camera_of(file), 1e6);
  ASSERT_EQ(small.size(), 20u);
  for (uint32_t i = 0; i < 30; ++i)
    EXPECT_EQ(std::ranges::binary_search(small, i), triangles_of(file, source, i) > kSide * kSide) << i;
}

TEST(ProxyChoice, VoxelsPayIfEnoughOfThePictureShowsThem) {
  const BakedFile file = mixed_balls(30, ProxyUse::kVoxels);
  const PackedSource source(file);
  const ProxyChoice choice(file);
  const std::vector<uint32_t> small = choice.small_instances(source, camera_of(file), 1e6);
  uint32_t other = 0;
  while (std::ranges::binary_search(small, other)) ++other;
  const auto pays = [&](size_t pixels_of_small) {
    GBuffer seen;
    seen.resize({10, 20}); // half of it misses the scene
    for (size_t i = 0; i < 100; ++i) seen.instance[2 * i] = i < pixels_of_small ? small[i % small.size()] : other;
    return choice.pays(small, source, seen);
  };
  // They save 0.06 log2(3480 / 24^2) = 0.156 of a ray's time and cost 0.1 elsewhere.
  EXPECT_FALSE(pays(0));
  EXPECT_FALSE(pays(38));
  EXPECT_TRUE(pays(40));
  EXPECT_TRUE(pays(100));
}

TEST(ProxyChoice, FilesWithoutVoxelsAreRefused) {
  EXPECT_THROW(ProxyChoice{mixed_balls(3, ProxyUse::kOff)}, Error);
  EXPECT_THROW(ProxyChoice{mixed_balls(3, ProxyUse::kField)}, Error); // slower than triangles
}

} // namespace
} // namespace packtrace
