#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/import_scene.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

/// Scenes of the folder that PACKTRACE_SCENES names.
class RealScene : public testing::Test {
protected:
  void SetUp() override {
    const char* folder = std::getenv("PACKTRACE_SCENES");
    if (folder == nullptr) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
    folder_ = folder;
  }

  Scene load(const std::string& file) const {
    Diagnostics diagnostics;
    Progress progress;
    return import_scene(folder_ / file, {}, diagnostics, progress).scene;
  }

  std::filesystem::path folder_;
};

TEST_F(RealScene, HouseKeepsItsTrianglesInFewBytes) {
  const BakedScene baked = test::bake(load("house/scene.pbrt"));
  EXPECT_EQ(baked.report.file.triangles, 1571178u);
  EXPECT_LT(baked.report.file.bytes_per_triangle, 7.8);                            // 7.72, 2.1 of them trees
  EXPECT_LT(static_cast<double>(baked.report.file.bytes.indices), 0.78 * 1571178); // 0.763; u8 x 3 takes 3
  EXPECT_GT(baked.report.file.triangles_per_cluster, 110.0); // 112.2, cut from a tree: fewer bytes than 125.6 grown
  EXPECT_LE(baked.report.max_position_error, baked.report.world_step * 0.5 + 1e-6);
  EXPECT_LE(baked.report.max_normal_error_degrees, 0.04);
}

TEST_F(RealScene, SpaceshipIsTheSameForAnyThreadCount) {
  const Scene scene = load("spaceship/scene.pbrt");
  const BakedScene first = test::bake(scene);
  EXPECT_EQ(first.report.file.triangles, 318558u);
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_TRUE(test::bake(scene).bytes == first.bytes);
}

} // namespace
} // namespace packtrace
