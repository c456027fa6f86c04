#include "compress/bake/bake_scene.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/compress/bake_checks.h"

namespace packtrace {
namespace {

using test::bake, test::scene_of, test::precision, test::masked_scene;

ErrorKind bake_kind(const Scene& scene, const BakeConfig& config = {}) {
  try {
    (void)bake(scene, config);
  } catch (const Error& error) {
    return error.kind();
  }
  ADD_FAILURE() << "the scene was accepted";
  return ErrorKind::kCancelled;
}

TEST(BakeScene, EmptyScenesAndMeshesAreFine) {
  EXPECT_EQ(bake({}).report.file.triangles, 0u);
  Scene scene = scene_of({});
  test::add_shape(scene, test::grid_mesh(2));
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  EXPECT_EQ(file.geometries()[0].triangle_count, 0u);
  EXPECT_EQ(file.geometries()[1].triangle_count, 8u);
  EXPECT_TRUE(BakedFile::from_bytes(bake({}).bytes).world_bounds().empty());
}

TEST(BakeScene, ScenesThatBreakTheRulesAreRefused) {
  const auto broken = [](auto&& change) {
    Scene scene = masked_scene();
    scene.shapes[0].material = 1;
    scene.meshes[0].normals.assign(scene.meshes[0].positions.size(), Vec3(0, 0, 1));
    change(scene);
    return bake_kind(scene);
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].positions[3].y = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].positions[3].y = HUGE_VALF; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].normals[3].y = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].normals.pop_back(); }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].uvs.pop_back(); }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].triangles[0].x = 169; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.shapes[0].mesh = 1; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.shapes[0].material = 9; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.shapes[0].parent_from_mesh[3].x = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.materials[1].alpha_mask = 1; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.masks[0].words.pop_back(); }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.masks[0].uv_scale.x = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.materials[2].albedo.x = 1.5f; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.cameras.push_back({}), s.cameras[0].width_px = 0; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.cameras.push_back({}), s.cameras[0].fov_degrees = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.instances.push_back({0, Affine(1.0f)}); }), ErrorKind::kInput);
}

struct BakedWithProblems {
  BakedScene baked;
  std::vector<Diagnostic> problems;
};

BakedWithProblems bake_reported(const Scene& scene, const BakeConfig& config = {}) {
  Diagnostics diagnostics;
  Progress progress;
  BakedScene baked = bake_to_bytes(scene, config, diagnostics, progress);
  return {std::move(baked), diagnostics.entries()};
}

bool reported(const BakedWithProblems& result, const std::string& message) {
  return std::any_of(result.problems.begin(), result.problems.end(), [&](const Diagnostic& d) {
    return d.severity == Severity::kError && d.message == message + "; it is left out";
  });
}

/// The error message of a strict bake; empty if it succeeds.
std::string strict_message(const Scene& scene) {
  BakeConfig config;
  config.strict = true;
  try {
    (void)bake(scene, config);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return {};
}

TEST(BakeScene, InstancesThatLeaveTheFloatRangeAreLeftOutByName) {
  Scene scene = scene_of(test::grid_mesh(2), test::scaling(DVec3(1e30)));
  scene.objects.push_back({"galaxy", std::move(scene.shapes)});
  scene.shapes.clear();
  scene.instances.push_back({0, Affine(test::scaling(DVec3(1e7)))});
  EXPECT_EQ(strict_message(scene), "");
  scene.instances.push_back({0, Affine(test::scaling(DVec3(1e20)))});
  scene.instances.push_back({0, Affine(test::scaling(DVec3(1e6)))});
  const BakedWithProblems result = bake_reported(scene);
  const BakedFile file = BakedFile::from_bytes(result.baked.bytes);
  ASSERT_EQ(file.instances().size(), 3u); // instance numbers do not change
  EXPECT_EQ(file.instances()[0].geometry, file.instances()[2].geometry);
  EXPECT_EQ(file.geometries()[file.instances()[1].geometry].triangle_count, 0u);
  EXPECT_EQ(result.baked.report.left_out, 1u);
  EXPECT_EQ(file.summary().left_out, 1u);
  const std::string what = "an instance of galaxy leaves the float range: its coordinates reach 1e+50";
  EXPECT_TRUE(reported(result, what));
  EXPECT_EQ(strict_message(scene), what);
  scene.instances = {scene.instances[1]}; // no instance of the geometry is left
  EXPECT_EQ(bake(scene).report.file.triangles, 0u);
}

TEST(BakeScene, ShapesThatLeaveTheFloatRangeAreLeftOutByName) {
  Scene scene = scene_of(test::grid_mesh(2));
  Mesh huge = test::sphere_mesh(4, 1e30f);
  huge.name = "sun";
  test::add_shape(scene, huge, test::scaling(DVec3(1e20)));
  test::add_shape(scene, test::grid_mesh(3));
  scene.objects.push_back({"system", {scene.shapes[0], scene.shapes[1]}});
  scene.instances.push_back({0, Affine(1.0f)});
  scene.instances.push_back({0, Affine(test::translation(DVec3(1.0)))});
  Affine beyond(1.0f);
  beyond[3].x = HUGE_VALF;
  scene.instances.push_back({0, beyond});
  scene.shapes[2].parent_from_mesh = test::translation({4, 0, 0});
  // An instance that is not finite is invalid input, not left out.
  EXPECT_EQ(bake_kind(scene), ErrorKind::kInput);
  scene.instances.pop_back();
  const BakedWithProblems result = bake_reported(scene);
  const BakedFile file = BakedFile::from_bytes(result.baked.bytes);
  ASSERT_EQ(file.instances().size(), 5u);
  const std::array<uint32_t, 5> triangles = {8, 0, 18, 8, 8};
  for (size_t i = 0; i < 5; ++i)
    EXPECT_EQ(file.geometries()[file.instances()[i].geometry].triangle_count, triangles[i]) << i;
  EXPECT_EQ(result.baked.report.left_out, 2u);
  EXPECT_TRUE(reported(result, "sun leaves the float range: its coordinates reach 1e+50"));
  EXPECT_TRUE(reported(result, "sun of system leaves the float range: its coordinates reach 1e+50"));
  EXPECT_EQ(strict_message(scene), "sun leaves the float range: its coordinates reach 1e+50");
}

TEST(BakeScene, TransformsOfSharedShapesThatNoFloatHoldsAreLeftOut) {
  Scene scene = scene_of(test::sphere_mesh(12, 1e-30f), test::scaling(DVec3(1e39)));
  scene.shapes.push_back(scene.shapes[0]);
  scene.shapes[1].parent_from_mesh = DAffine(1.0);
  const BakedScene baked = bake(scene);
  EXPECT_EQ(baked.report.left_out, 1u);
  EXPECT_GT(baked.report.file.triangles, 0u);
}

TEST(BakeScene, WhatIsLeftAloneStaysOnTheWorldsGrid) {
  Scene scene = scene_of(test::sphere_mesh(12));
  scene.shapes.push_back(scene.shapes[0]);
  // This shape is left out, so the other one has nothing to share with.
  scene.shapes[1].parent_from_mesh = test::scaling(DVec3(1e50));
  const BakedScene baked = bake(scene);
  EXPECT_EQ(baked.report.left_out, 1u);
  EXPECT_EQ(baked.report.instanced_shapes, 0u);
  EXPECT_NE(BakedFile::from_bytes(baked.bytes).geometries()[0].flags & baked::kWorldSpace, 0u);
}

TEST(BakeScene, LatticesBeyondTheLimitAreAnErrorThatNamesIt) {
  Scene scene = scene_of(test::grid_mesh(4), test::scaling(DVec3(1e30)));
  try {
    (void)bake(scene, precision(PrecisionKind::kAbsolute, 1e-9));
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded);
    EXPECT_NE(std::string(error.what()).find("coordinates up to 1e+30 at a step of 9"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("2^55"), std::string::npos);
  }
}

TEST(BakeScene, CancellingStopsTheBake) {
  struct Guard { // cancellation is process-wide and irreversible, so this test runs in a child process
    static void run() {
      Progress::cancel();
      Diagnostics diagnostics;
      Progress progress;
      try {
        (void)bake_to_bytes(scene_of(test::grid_mesh(4)), {}, diagnostics, progress);
      } catch (const Error& error) {
        std::exit(error.exit_code());
      }
      std::exit(0);
    }
  };
  EXPECT_EXIT(Guard::run(), testing::ExitedWithCode(7), "");
}

} // namespace
} // namespace packtrace
