#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "assets/generator/forest.h"
#include "assets/generator/town.h"
#include "pbrt_import/import_scene.h"
#include "tests/assets/folder_content.h"
#include "tests/temporary_folder.h"

namespace packtrace::scenegen {
namespace {

const std::filesystem::path kShippedScenes = std::filesystem::path(PACKTRACE_SOURCE_DIR) / "assets";

std::string complaints(const Diagnostics& diagnostics) {
  std::string text;
  for (const Diagnostic& d : diagnostics.entries()) {
    if (d.severity != Severity::kNote) text += to_string(d) + "\n";
  }
  return text;
}

ImportResult import_quietly(const std::filesystem::path& path) {
  Diagnostics diagnostics;
  Progress progress;
  ImportResult result = import_scene(path, {}, diagnostics, progress);
  EXPECT_EQ(complaints(diagnostics), "") << path;
  EXPECT_EQ(result.scene.dropped_triangles, 0u) << path;
  return result;
}

TEST(CommittedScenes, FeaturesImportWithoutComplaint) {
  size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kShippedScenes / "features")) {
    if (entry.path().extension() != ".pbrt") continue;
    ++count;
    const Scene scene = import_quietly(entry.path()).scene;
    const std::string name = entry.path().stem().string();
    EXPECT_EQ(placed_triangle_count(scene) == 0, name == "empty_world") << name;
    EXPECT_EQ(scene.cameras.empty(), name == "no_camera") << name;
  }
  EXPECT_GE(count, 30u);
}

TEST(CommittedScenes, RoomImportsWithoutComplaint) {
  const Scene scene = import_quietly(kShippedScenes / "room/room.pbrt").scene;
  EXPECT_EQ(scene.masks.size(), 1u);
  EXPECT_GT(scene.instances.size(), 500u);
}

TEST(CommittedScenes, TexturedHasFiveTexturesAMaskAndABumpMap) {
  Diagnostics diagnostics;
  Progress progress;
  ImportOptions options;
  options.keep_textures = true;
  const Scene scene = import_scene(kShippedScenes / "textured/textured.pbrt", options, diagnostics, progress).scene;
  EXPECT_EQ(complaints(diagnostics), "");
  EXPECT_EQ(scene.textures.size(), 5u);
  EXPECT_EQ(scene.masks.size(), 1u);
  EXPECT_EQ(std::count_if(scene.materials.begin(), scene.materials.end(),
                          [](const Material& m) { return (m.flags & kNormalMap) != 0; }),
            1);
}

TEST(CommittedScenes, ExtremeKeepsItsSmallestAndItsLargest) {
  const Scene scene = import_quietly(kShippedScenes / "extreme/extreme.pbrt").scene;
  std::vector<float> sizes;
  for (const Instance& instance : scene.instances) sizes.push_back(glm::length(instance.world_from_object[0]));
  EXPECT_LT(*std::min_element(sizes.begin(), sizes.end()), 1e-6f);
  EXPECT_GT(*std::max_element(sizes.begin(), sizes.end()), 9e5f);
  EXPECT_GT(world_bounds(scene).hi.x, 9e6);
}

TEST(Generators, TheImporterFindsWhatWasWritten) {
  const TemporaryFolder folder;
  const SceneTotals town = generate_town({5, 4000}, {folder / "town", false});
  const Scene town_scene = import_quietly(folder / "town/town.pbrt").scene;
  EXPECT_EQ(town_scene.instances.size(), town.instances);
  EXPECT_EQ(placed_triangle_count(town_scene), town.placed_triangles);
  const SceneTotals forest = generate_forest({5, 1'000'000, 0}, {folder / "forest", false});
  const Scene forest_scene = import_quietly(folder / "forest/forest.pbrt").scene;
  EXPECT_EQ(forest_scene.instances.size(), forest.instances);
  EXPECT_EQ(placed_triangle_count(forest_scene), forest.placed_triangles);
}

TEST(Generators, TreesStandOnTheGround) {
  const TemporaryFolder folder;
  generate_forest({5, 1'000'000, 0}, {folder / "forest", false});
  const Scene scene = import_quietly(folder / "forest/forest.pbrt").scene;
  const Mesh& ground = scene.meshes[scene.shapes.at(0).mesh];
  ASSERT_GT(scene.instances.size(), 100u);
  for (const Instance& instance : scene.instances) {
    const Vec3 foot = instance.world_from_object[3];
    double nearest = 1e30, height = 0.0; // of the ground point next to it in plan
    for (const Vec3& p : ground.positions) {
      const double distance = glm::length(glm::dvec2(p.x - foot.x, p.z - foot.z));
      if (distance < nearest) nearest = distance, height = p.y;
    }
    EXPECT_NEAR(foot.y, height, 1.6) << foot.x << " " << foot.z;
  }
}

} // namespace
} // namespace packtrace::scenegen
