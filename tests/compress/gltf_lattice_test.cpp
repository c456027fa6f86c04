#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/compress/gltf_round_trip.h"
#include "tests/compress/gltf_test_support.h"
#include "tests/compress/test_scenes.h"
#include "tests/compress/world_faces.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using namespace gltf_test;
using test::world_faces;

/// Adds a triangle whose mesh states its lattice.
/// @param step power of two
/// @param corners in steps
void add_stated(Scene& scene, double step, std::vector<Vec3> corners) {
  Mesh mesh;
  mesh.positions = std::move(corners);
  for (Vec3& p : mesh.positions) p *= static_cast<float>(step);
  mesh.triangles = {{0, 1, 2}};
  mesh.lattice = {8, static_cast<int32_t>(std::log2(step)) - 3};
  if (scene.meshes.empty())
    scene = test::scene_of(std::move(mesh));
  else
    test::add_shape(scene, std::move(mesh));
}

std::vector<double> steps_of(const BakedFile& file) {
  std::vector<double> steps;
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g)
    steps.push_back(PositionGrid{file.geometries()[g].step_mantissa, file.geometries()[g].step_exponent}.step());
  return steps;
}

void expect_same_after_export(const BakedFile& file, const GltfConfig& config) {
  const TemporaryFolder folder;
  write(folder / "a.glb", export_of(file, config).bytes);
  const BakedScene again = bake_again(folder / "a.glb");
  const BakedFile back = BakedFile::from_bytes(again.bytes);
  EXPECT_EQ(steps_of(back), steps_of(file));
  EXPECT_EQ(world_faces(back), world_faces(file));
}

/// Positions in object units, since no frame holds their extent of more than 2^23 steps, have the geometry's lattice.
TEST(GltfRoundTrip, LatticesOfFloatsAmongIntegersAreEqual) {
  Scene scene;
  add_stated(scene, 0.5, {{0, 0, 0}, {8388999, 0, 0}, {0, 8388999, 5}});
  const BakedScene baked = bake_for_shading(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(steps_of(file), std::vector<double>{0.5});
  const GltfExport result = export_of(file, gltf_profile(GltfProfile::kWeb));
  ASSERT_EQ(result.report.plain_primitives, 1u);
  expect_same_after_export(file, gltf_profile(GltfProfile::kWeb));
}

TEST(GltfRoundTrip, LatticesOfIntegersWithNamesAreEqual) {
  Scene scene;
  add_stated(scene, 0.25, {{1, 0, 0}, {101, 0, 0}, {0, 103, 5}});
  const BakedScene baked = bake_for_shading(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(steps_of(file), std::vector<double>{0.25});
  GltfConfig config = gltf_profile(GltfProfile::kExchange);
  config.codec = GltfCodec::kMeshopt;
  expect_same_after_export(file, config);
  expect_same_after_export(file, gltf_profile(GltfProfile::kWeb));
}

/// Draco decodes what is near 0 with the rounding errors of what is far from it.
TEST(GltfRoundTrip, LatticesOfSmallMeshesInLargeWorldsAreEqual) {
  Scene scene;
  add_stated(scene, 0x1p-10, {{1, 0, 0}, {101, 7, 0}, {0, 103, 5}});
  add_stated(scene, 0x1p-10, {{-54331, 1, 77777}, {-54321, -60000, 3}, {1234, -54387, 3}});
  const BakedScene baked = bake_for_shading(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(steps_of(file), (std::vector<double>{0x1p-10, 0x1p-10}));
  for (const GltfProfile profile : {GltfProfile::kPortable, GltfProfile::kExchange})
    expect_same_after_export(file, gltf_profile(profile));
}

TEST(GltfRoundTrip, FalseLatticesAreIgnored) {
  for (const float corner : {5.0f, 5.25f}) {
    Scene scene;
    add_stated(scene, 1.0, {{0, 0, 0}, {100, 0, 0}, {0, 100, corner}});
    BakeConfig config;
    Diagnostics diagnostics;
    Progress progress;
    const BakedScene baked = bake_to_bytes(scene, config, diagnostics, progress);
    const auto warned = std::ranges::count_if(baked.report.warnings, [](const std::string& warning) {
      return warning.find("off the lattice that they state") != std::string::npos;
    });
    EXPECT_EQ(warned, corner == 5.0f ? 0 : 1);
    EXPECT_EQ(steps_of(BakedFile::from_bytes(baked.bytes))[0] == 1.0, corner == 5.0f);
  }
}

/// Each mesh lies within a frame, but no frame holds both, though their extent takes no more bits than the first's.
TEST(GltfWeb, MeshesWithoutCommonFrameStayApart) {
  Scene scene;
  add_stated(scene, 1.0, {{-8380000, 0, 0}, {8200000, 0, 0}, {0, 8000000, 5}});
  add_stated(scene, 1.0, {{8380000, 0, 0}, {8395000, 0, 0}, {8390000, 8000, 5}});
  const BakedScene baked = bake_for_shading(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(steps_of(file), (std::vector<double>{1.0, 1.0}));
  const GltfExport result = export_of(file, gltf_profile(GltfProfile::kWeb));
  EXPECT_EQ(result.report.plain_primitives, 0u);
  EXPECT_EQ(result.report.meshes, 2u);
  expect_same_after_export(file, gltf_profile(GltfProfile::kWeb));
}

} // namespace
} // namespace packtrace
