#include "runtime/trace/source/float_source.h"

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

struct Decoded {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  Decoded(const SceneSource& source, uint32_t geometry)
      : positions(source.counts(geometry).vertices), triangles(source.counts(geometry).triangles) {
    source.decode(geometry, positions, triangles);
  }
  Vec3 normal(uint32_t t) const {
    const Vec3 p = positions[triangles[t].x];
    return glm::normalize(glm::cross(positions[triangles[t].y] - p, positions[triangles[t].z] - p));
  }
};

TEST(FloatSource, ShapesComeFirstThenObjectsAndInstances) {
  Scene scene;
  test::add_shape(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  const uint32_t object = test::add_object(scene, test::box({0, 0, 0}, {1, 1, 1}));
  scene.instances = {{object, Affine(test::placed({5, 0, 0}))}, {object, Affine(test::placed({9, 0, 0}))}};
  const FloatSource source(scene);
  ASSERT_EQ(source.geometry_count(), 2u);
  EXPECT_EQ(source.counts(0).triangles, 2u);
  EXPECT_EQ(source.counts(1).triangles, 12u);
  ASSERT_EQ(source.instances().size(), 3u);
  EXPECT_EQ(source.instances()[0].geometry, 0u);
  EXPECT_EQ(source.instances()[2].geometry, 1u);
  EXPECT_EQ(source.instances()[2].world_from_object[3].x, 9.0f);
}

TEST(FloatSource, MirroringAndReversingKeepPbrtsGeometricNormal) {
  const Mesh mesh = test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}); // normal: +z
  for (const bool mirrored : {false, true})
    for (const bool reversed : {false, true}) {
      Scene scene;
      test::add_shape(scene, mesh, 0, test::placed({0, 0, 0}, {mirrored ? -2 : 2, 1, 1}));
      scene.shapes[0].reverse_orientation = reversed;
      const Decoded decoded(FloatSource(scene), 0);
      EXPECT_EQ(decoded.normal(0).z, reversed ? -1.0f : 1.0f) << mirrored << reversed;
      EXPECT_EQ(decoded.normal(1).z, reversed ? -1.0f : 1.0f) << mirrored << reversed;
    }
}

TEST(FloatSource, UvFollowsThePointThroughSwappedWinding) {
  Scene scene;
  test::add_shape(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), 0, test::placed({0, 0, 0}, {-1, 1, 1}));
  const FloatSource source(scene);
  const Decoded decoded(source, 0);
  const Vec2 barycentrics(0.25f, 0.5f);
  for (uint32_t t = 0; t < 2; ++t) {
    const Triangle v = decoded.triangles[t];
    const Vec3 p = decoded.positions[v.x] * 0.25f + decoded.positions[v.y] * 0.25f + decoded.positions[v.z] * 0.5f;
    const Vec2 uv = interpolated_uv(source.corner_uvs(0, t), barycentrics);
    EXPECT_NEAR(uv.x, -p.x, 1e-6f);
    EXPECT_NEAR(uv.y, p.y, 1e-6f);
  }
}

TEST(FloatSource, NormalsTravelWithTheInverseTranspose) {
  Scene scene;
  Mesh mesh = test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.normals.assign(4, glm::normalize(Vec3(1, 0, 1)));
  test::add_shape(scene, mesh, 0, test::placed({0, 0, 0}, {1, 1, 2}));
  const auto normal = FloatSource(scene).shading_normal(0, 0, {0.2f, 0.3f});
  ASSERT_TRUE(normal.has_value());
  EXPECT_NEAR(normal->x / normal->z, 2.0f, 1e-5f);
  EXPECT_NEAR(glm::length(*normal), 1.0f, 1e-6f);
}

TEST(FloatSource, ObjectsMergeTheirShapesAndKeepMaterials) {
  Scene scene;
  const uint32_t object = test::add_object(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  scene.meshes.push_back(Mesh{"empty", {}, {}, {}, {}});
  scene.meshes.push_back(test::box({0, 0, 0}, {1, 1, 1}));
  scene.materials.resize(3);
  scene.objects[object].shapes.push_back({1, 1, false, DAffine(1.0)});
  scene.objects[object].shapes.push_back({2, 2, false, test::placed({10, 0, 0})});
  scene.instances.push_back({object, Affine(1.0f)});
  const FloatSource source(scene);
  const Decoded decoded(source, 0);
  EXPECT_EQ(source.material_of(0, 1), 0u);
  EXPECT_EQ(source.material_of(0, 2), 2u);
  EXPECT_EQ(source.material_of(0, 13), 2u);
  EXPECT_EQ(decoded.positions[decoded.triangles[2].x].x, 10.0f);
  EXPECT_FALSE(source.shading_normal(0, 5, {0, 0}).has_value());
  EXPECT_EQ(interpolated_uv(source.corner_uvs(0, 5), {0.5f, 0.5f}), Vec2(0));
}

TEST(FloatSource, RejectsReferencesOutOfRange) {
  Scene scene;
  test::add_shape(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  Scene no_mesh = scene, no_material = scene, no_object = scene;
  no_mesh.shapes[0].mesh = 1;
  no_material.shapes[0].material = 7;
  no_object.instances.push_back({0, Affine(1.0f)});
  EXPECT_THROW(FloatSource{no_mesh}, Error);
  EXPECT_THROW(FloatSource{no_material}, Error);
  EXPECT_THROW(FloatSource{no_object}, Error);
}

} // namespace
} // namespace packtrace
