#include "compress/bake/bake_scene.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/compress/bake_checks.h"

namespace packtrace {
namespace {

using test::bake, test::decode, test::Decoded, test::scene_of, test::precision, test::winding_agreement;

TEST(BakeScene, EqualMeshesAreStoredOnceAndInstanced) {
  Scene scene;
  scene.materials.push_back({});
  scene.materials.push_back({});
  test::add_shape(scene, test::grid_mesh(20), test::translation({9, 0, 0}));
  for (const double x : {1.0, 2.0, 3.0}) test::add_shape(scene, test::sphere_mesh(16), test::translation({x, 0, 0}));
  scene.shapes[2].parent_from_mesh = test::scaling({-1, 1, 1});
  scene.materials[1].flags = kTransmissive;
  test::add_shape(scene, test::sphere_mesh(16), test::translation({4, 0, 0}), 1); // another material class
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 3u);
  EXPECT_EQ(baked.report.shared_shapes, 2u);
  ASSERT_EQ(file.instances().size(), 5u);
  const std::array<uint32_t, 5> expected = {0, 1, 1, 1, 2};
  for (uint32_t i = 0; i < 5; ++i) EXPECT_EQ(file.instances()[i].geometry, expected[i]);
  EXPECT_EQ(file.world_from_object(1)[3], Vec3(1, 0, 0));
  EXPECT_EQ(file.world_from_object(2)[0], Vec3(-1, 0, 0));
  EXPECT_EQ(file.world_from_object(4), Affine(1.0f)); // not shared: in world space
  EXPECT_EQ(file.geometries()[1].flags & baked::kWorldSpace, 0u);
  EXPECT_NE(file.geometries()[2].flags & baked::kWorldSpace, 0u);
  EXPECT_GT(winding_agreement(decode(file, 1)), 0.5);
}

std::vector<uint32_t> materials_of(const BakedFile& file, uint32_t instance) {
  const auto materials = file.instance_materials(instance);
  return {materials.begin(), materials.end()};
}

TEST(BakeScene, ShapesThatDifferInMaterialShareAGeometry) {
  Scene scene;
  scene.materials.resize(4);
  scene.materials[1].flags = kMirror; // the same class as without flags
  scene.materials[2].flags = kInvisible;
  scene.materials[3].albedo = Vec3(1);
  for (const uint32_t material : {0u, 1u, 2u, 3u, 1u})
    test::add_shape(scene, test::sphere_mesh(16), test::translation({1.0 * material, 0, 0}), material);
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 2u);
  const std::array<uint32_t, 5> geometries = {0, 0, 1, 0, 0}, materials = {0, 1, 2, 3, 1};
  for (uint32_t i = 0; i < 5; ++i) {
    EXPECT_EQ(file.instances()[i].geometry, geometries[i]);
    EXPECT_EQ(materials_of(file, i), std::vector{materials[i]});
  }
  EXPECT_EQ(file.sections().material_slots.size(), 4u); // equal runs are stored once
  EXPECT_EQ(baked.report.shared_shapes, 3u);
  EXPECT_EQ(baked.report.instanced_shapes, 4u);
}

TEST(BakeScene, ShapesInOnePlaceShareAWorldSpaceGeometry) {
  Scene scene;
  scene.materials.resize(2);
  for (const uint32_t material : {0u, 1u}) test::add_shape(scene, test::grid_mesh(3), DAffine(1.0), material);
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  ASSERT_EQ(file.geometries().size(), 1u);
  EXPECT_NE(file.geometries()[0].flags & baked::kWorldSpace, 0u);
  EXPECT_EQ(materials_of(file, 1), std::vector{1u});
}

TEST(BakeScene, ShapesOfOneMeshShareItHoweverSmall) {
  Scene scene;
  scene.materials.resize(1000);
  scene.meshes.push_back(test::sphere_mesh(3));
  for (uint32_t i = 0; i < 1000; ++i) scene.shapes.emplace_back(0, i, false, test::translation({3.0 * i, 0, 0}));
  scene.objects.push_back({"the same", {Shape{0, 7, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(test::translation({0, 0, 9}))});
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(file.geometries().size(), 1u);
  EXPECT_EQ(file.geometries()[0].triangle_count, scene.meshes[0].triangles.size());
  EXPECT_EQ(materials_of(file, 999), std::vector{999u});
  EXPECT_EQ(materials_of(file, 1000), std::vector{7u});
  EXPECT_EQ(file.world_from_object(999)[3], Vec3(2997, 0, 0));
  EXPECT_EQ(baked.report.seams.touching, 0u);
  EXPECT_TRUE(baked.report.warnings.empty());
  EXPECT_LT(baked.bytes.size(), 1001 * (sizeof(baked::InstanceRecord) + 4 + sizeof(baked::MaterialRecord)) + 4096);
}

TEST(BakeScene, InstancedShapesCountForTheScenesStep) {
  // A floor of two large triangles below many small spheres. With a step from the floor alone, spheres and floor would
  // lose their relative position.
  Scene scene = scene_of(test::grid_mesh(1), compose(test::translation({-50, -50, -1}), test::scaling(DVec3(100))));
  scene.meshes.push_back(test::sphere_mesh(8));
  for (uint32_t i = 0; i < 20; ++i)
    scene.shapes.emplace_back(
        1, 0, false, compose(test::translation({2.0 * i, 0, 0}), test::scaling(DVec3(i % 2 == 0 ? 0.5 : 1.0))));
  const BakeReport shared = bake(scene).report;
  EXPECT_EQ(shared.instanced_shapes, 20u);
  Scene wide = scene;
  wide.shapes[20].parent_from_mesh = test::translation({1000, 0, 0});
  EXPECT_GT(bake(wide, precision(PrecisionKind::kPositionBits, 14.0)).report.world_step, 1000.0 / (1 << 14) * 0.88);
  for (uint32_t i = 1; i < 21; ++i) { // now with different meshes, so that nothing is shared
    Mesh own = scene.meshes[1];
    own.positions[0].z *= 1.0f + 1e-3f * static_cast<float>(i);
    scene.shapes[i].mesh = static_cast<uint32_t>(scene.meshes.size());
    scene.meshes.push_back(own);
  }
  const BakeReport apart = bake(scene).report;
  EXPECT_EQ(apart.instanced_shapes, 0u);
  EXPECT_NEAR(shared.world_median_edge, apart.world_median_edge, 0.04 * apart.world_median_edge);
  EXPECT_LT(shared.world_median_edge, 1.0);
}

TEST(BakeScene, InstancesOnGridsOfTheirOwnThatTouchAreCounted) {
  Scene scene;
  scene.materials.resize(1);
  scene.meshes.push_back(test::sphere_mesh(8)); // radius 1
  for (const double x : {0.0, 2.0, 9.0}) scene.shapes.emplace_back(0, 0, false, test::translation({x, 0, 0}));
  const BakeReport report = bake(scene).report;
  EXPECT_EQ(report.instanced_shapes, 3u);
  EXPECT_EQ(report.seams.touching, 2u);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("the boxes of 2 of 3 instances touch"), std::string::npos) << report.warnings[0];
  test::add_shape(scene, test::grid_mesh(2), test::translation({8.5, 0, 0}));
  EXPECT_EQ(bake(scene).report.seams.touching, 3u);
}

TEST(BakeScene, ObjectsThatDifferInMaterialShareAGeometry) {
  // Walls, roof and door: the first house uses one material for everything; the others differ in which parts share a
  // material.
  Scene scene;
  scene.materials.resize(5);
  scene.materials[4].flags = kTransmissive;
  scene.meshes = {test::grid_mesh(3), test::sphere_mesh(6), test::grid_mesh(4), {}};
  const auto house = [](uint32_t wall, uint32_t roof, uint32_t door) {
    const auto shape = [](uint32_t mesh, uint32_t material) { return Shape{mesh, material, false, DAffine(1.0)}; };
    return std::vector{shape(3, 1), shape(0, wall), shape(1, roof), shape(2, door)};
  };
  scene.objects = {
      {"plain", house(0, 0, 0)}, {"two", house(1, 2, 1)}, {"two others", house(3, 0, 3)}, {"glass", house(4, 0, 0)}};
  scene.instances = {{1, Affine(1.0f)}, {0, Affine(1.0f)}, {3, Affine(1.0f)}, {2, Affine(1.0f)}};
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 2u);
  EXPECT_EQ(baked.report.shared_objects, 2u);
  // Wall and door share a slot, because they have the same material in every object.
  EXPECT_EQ(materials_of(file, 0), (std::vector{1u, 2u}));
  EXPECT_EQ(materials_of(file, 1), (std::vector{0u, 0u}));
  EXPECT_EQ(materials_of(file, 3), (std::vector{3u, 0u}));
  EXPECT_EQ(materials_of(file, 2), (std::vector{0u, 4u})); // ordered by class: occluding materials first
  const Decoded all = decode(file, file.instances()[0].geometry);
  EXPECT_EQ(std::count(all.slots.begin(), all.slots.end(), 0u), 18 + 32);
  EXPECT_EQ(std::count(all.slots.begin(), all.slots.end(), 1u), std::ssize(scene.meshes[1].triangles));
}

TEST(BakeScene, SmallEqualMeshesStayInWorldSpaceSoThatTheyTouch) {
  Scene scene;
  scene.materials.push_back({});
  for (const double x : {0.0, 1.0}) test::add_shape(scene, test::grid_mesh(4), test::translation({x, 0, 0}));
  EXPECT_EQ(BakedFile::from_bytes(bake(scene).bytes).geometries().size(), 2u);
  scene.shapes[1].parent_from_mesh = scene.shapes[0].parent_from_mesh; // the same place, so sharing loses nothing
  EXPECT_EQ(BakedFile::from_bytes(bake(scene).bytes).geometries().size(), 1u);
}

TEST(BakeScene, EqualObjectsShareAGeometryAndUnusedOnesAreLeftOut) {
  Scene scene;
  scene.materials.push_back({});
  scene.meshes = {test::sphere_mesh(8), test::sphere_mesh(8), test::grid_mesh(3)};
  scene.objects = {{"a", {Shape{0, 0, false, DAffine(1.0)}}},
                   {"unused", {Shape{2, 0, false, DAffine(1.0)}}},
                   {"b", {Shape{1, 0, false, DAffine(1.0)}}},
                   {"empty", {}}};
  scene.instances = {{2, Affine(1.0f)}, {0, Affine(1.0f)}, {3, Affine(1.0f)}};
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(file.geometries().size(), 2u);
  EXPECT_EQ(file.instances()[0].geometry, file.instances()[1].geometry);
  EXPECT_EQ(baked.report.shared_objects, 1u);
  EXPECT_EQ(baked.report.unused_objects, 1u);
  EXPECT_EQ(baked.report.unused_triangles, 18u);
  EXPECT_EQ(file.geometries()[file.instances()[2].geometry].triangle_count, 0u);
}

} // namespace
} // namespace packtrace
