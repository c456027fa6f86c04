#include "assets/generator/meadow.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "assets/generator/grass_files.h"
#include "pbrt_import/files/ply.h"
#include "pbrt_import/import_scene.h"
#include "tests/assets/folder_content.h"
#include "tests/temporary_folder.h"

namespace packtrace::scenegen {
namespace {

const std::filesystem::path kMeadow = std::filesystem::path(PACKTRACE_SOURCE_DIR) / "assets/meadow";

Mesh mesh_of(const std::string& content) {
  std::string problem;
  PlyMesh ply = read_ply(std::as_bytes(std::span(content)), [&](auto, auto, std::string text) { problem = text; });
  EXPECT_EQ(problem, "");
  EXPECT_EQ(ply.dropped_triangles, 0u);
  return std::move(ply.mesh);
}

std::string frame_name(const std::string& stem, uint32_t frame) {
  std::string number = std::to_string(frame);
  return "geometry/" + stem + "_" + number.insert(0, 4 - number.size(), '0') + ".ply";
}

Scene import_meadow(const std::filesystem::path& file, bool textures) {
  Diagnostics diagnostics;
  Progress progress;
  ImportOptions options;
  options.keep_textures = textures;
  options.keep_unused_objects = true; // levels that no patch shows at first
  Scene scene = import_scene(file, options, diagnostics, progress).scene;
  for (const Diagnostic& d : diagnostics.entries()) EXPECT_EQ(d.severity, Severity::kNote) << to_string(d);
  return scene;
}

TEST(Meadow, FramesOfALodHaveOneTopologyAndDifferentPositions) {
  const auto files = files_under(kMeadow);
  const GrassConfig grass = meadow_grass({});
  for (uint32_t lod = 0; lod < kGrassLods; ++lod) {
    const std::string stem = grass_name(grass, {lod, 0, 0});
    const Mesh first = mesh_of(files.at(frame_name(stem, 0)));
    EXPECT_EQ(first.triangles.size(), uint64_t{kBladeTriangles} * grass_blade_count(grass, lod));
    EXPECT_EQ(first.uvs.size(), first.positions.size());
    std::vector<Vec3> before = first.positions;
    const uint32_t frames = lod + 1 < kGrassLods ? MeadowConfig().frames : 1;
    for (uint32_t frame = 1; frame < frames; ++frame) {
      const Mesh mesh = mesh_of(files.at(frame_name(stem, frame)));
      EXPECT_EQ(mesh.triangles, first.triangles);
      ASSERT_EQ(mesh.positions.size(), first.positions.size());
      EXPECT_NE(mesh.positions, before);
      before = mesh.positions;
    }
    EXPECT_FALSE(files.contains(frame_name(stem, frames)));
  }
}

TEST(Meadow, TheFirstFrameAfterTheLoopIsTheFirst) {
  const TemporaryFolder folder;
  MeadowConfig config{.patches = 60, .blades = 100};
  const GrassField field = make_grass_field(meadow_grass(config));
  generate_meadow(config, {folder / "a", false});
  const Mesh first = mesh_of(files_under(folder / "a").at(frame_name("grass_0", 0)));
  const auto blades = make_grass_blades(field, 0, 0, 0);
  std::vector<Vec3> positions(blades.size() * kBladeVertices);
  write_grass_positions(blades, wind_moment(field.wind, 1.0), positions);
  EXPECT_EQ(positions, first.positions);
}

TEST(Meadow, ImportsWithoutComplaintAndWithWhatMoves) {
  const Scene scene = import_meadow(kMeadow / "meadow.pbrt", true);
  EXPECT_EQ(scene.dropped_triangles, 0u);
  EXPECT_EQ(scene.textures.size(), 3u);
  EXPECT_EQ(scene.time, 0.0);
  EXPECT_EQ(scene.animated_instances.size(), 10u) << "sails and birds";
  std::set<std::string> grass;
  for (const Mesh& mesh : scene.meshes)
    if (mesh.name.starts_with("grass_")) grass.insert(mesh.name);
  EXPECT_EQ(grass.size(), kGrassLods) << "all LODs are in use";
}

TEST(Meadow, PatchesKeepTheWindsDirectionAndTheGrid) {
  const TemporaryFolder folder;
  const MeadowConfig config{.patches = 700, .blades = 4, .tile = 2, .frames = 2};
  const SceneTotals totals = generate_meadow(config, {folder / "meadow", false});
  const Scene scene = import_meadow(folder / "meadow/meadow.pbrt", false);
  EXPECT_EQ(scene.instances.size(), totals.instances);
  EXPECT_EQ(placed_triangle_count(scene), totals.placed_triangles);
  std::set<std::pair<float, float>> corners;
  for (const Instance& instance : scene.instances) {
    if (!scene.objects[instance.object].name.starts_with("grass_")) continue;
    const Affine& m = instance.world_from_object;
    EXPECT_EQ(Vec2(m[0].x, m[0].z), Vec2(1, 0));
    EXPECT_EQ(Vec2(m[1].x, m[1].z), Vec2(0, 0));
    EXPECT_EQ(Vec2(m[2].x, m[2].z), Vec2(0, 1));
    EXPECT_TRUE(corners.insert({m[3].x, m[3].z}).second) << "two patches in one place";
    // Names are grass_LOD_PATCH_TONE: a patch must stand where its own wind blows.
    const float column = m[3].x / 3.0f, row = m[3].z / 3.0f;
    ASSERT_EQ(column, std::floor(column));
    ASSERT_EQ(row, std::floor(row));
    const int patch = (static_cast<int>(row) & 1) * 2 + (static_cast<int>(column) & 1);
    EXPECT_EQ(scene.objects[instance.object].name.substr(8, 1), std::to_string(patch));
  }
  EXPECT_EQ(corners.size(), config.patches);
}

TEST(Meadow, SixtyFourPatchesOfTenThousandBladesHaveThreePointTwoMillionTriangles) {
  const TemporaryFolder folder;
  const SceneTotals few = generate_meadow({.patches = 64, .blades = 1, .frames = 1}, {folder / "few", false});
  const SceneTotals many = generate_meadow({.patches = 64, .blades = 10'000, .frames = 1}, {folder / "many", false});
  EXPECT_EQ(many.placed_triangles - few.placed_triangles, 64u * 9'999u * kBladeTriangles);
  const SceneTotals apart =
      generate_meadow({.patches = 64, .blades = 1, .tile = 16, .frames = 1}, {folder / "c", false});
  EXPECT_EQ(apart.unique_triangles - few.unique_triangles, 63u * kGrassLods * kBladeTriangles)
      << "no two patches are equal";
}

} // namespace
} // namespace packtrace::scenegen
