#include "pbrt_import/scene/scene.h"

#include <gtest/gtest.h>

namespace packtrace {
namespace {

/// A mesh of two triangles in the world, and an object that contains the mesh twice and has three instances.
Scene make_scene() {
  Scene scene;
  Mesh mesh;
  mesh.positions = {Vec3(0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes = {mesh};
  scene.materials = {Material{}};
  scene.shapes = {Shape{}};
  scene.objects = {Object{"pair", {Shape{}, Shape{}}}};
  scene.objects[0].shapes[1].parent_from_mesh[3] = DVec3(0, 0, 2);
  for (const float x : {10.0f, 20.0f, -30.0f}) {
    Instance instance;
    instance.world_from_object[3] = Vec3(x, 0, 0);
    scene.instances.push_back(instance);
  }
  return scene;
}

TEST(Scene, CountsStoredAndPlacedTriangles) {
  const Scene scene = make_scene();
  EXPECT_EQ(unique_triangle_count(scene), 2u + 4u);
  EXPECT_EQ(placed_triangle_count(scene), 2u + 3u * 4u);
}

TEST(Scene, BoundsHoldEveryInstance) {
  const Bounds bounds = world_bounds(make_scene());
  EXPECT_EQ(bounds.lo, DVec3(-30, 0, 0));
  EXPECT_EQ(bounds.hi, DVec3(21, 1, 2));
}

TEST(MaterialFlags, SayWhoSeesASurface) {
  EXPECT_TRUE(camera_visible(0) && occludes(0) && !needs_mask(0));
  EXPECT_TRUE(camera_visible(kTransmissive) && !occludes(kTransmissive));
  EXPECT_TRUE(!camera_visible(kInvisible) && occludes(kInvisible));
  EXPECT_TRUE(camera_visible(kNoShadow) && !occludes(kNoShadow));
  EXPECT_TRUE(!camera_visible(kAbsent) && !occludes(kAbsent));
  EXPECT_TRUE(needs_mask(kAlphaMask) && needs_mask(kShadowAlphaMask) && !needs_mask(kEmissive));
}

} // namespace
} // namespace packtrace
