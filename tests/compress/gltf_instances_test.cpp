#include "compress/exchange/gltf/gltf_instances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/compress/gltf_test_support.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using namespace gltf_test;

/// Map of an angle about y, scales, and a translation.
DAffine turned(double angle, DVec3 scale, DVec3 translation) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {DVec3(c, 0, -s) * scale.x, DVec3(0, 1, 0) * scale.y, DVec3(s, 0, c) * scale.z, translation};
}

TEST(GltfInstances, MapsAreDecomposed) {
  const std::optional<InstanceTransform> found = decompose_instance(turned(0.5, {2, 3, 4}, {5, 6, 7}));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->translation, (std::array<float, 3>{5, 6, 7}));
  EXPECT_NEAR(found->scale[0], 2.0f, 1e-6f);
  EXPECT_NEAR(found->scale[2], 4.0f, 1e-6f);
  EXPECT_NEAR(found->rotation[1], std::sin(0.25), 1e-6);
  EXPECT_NEAR(found->rotation[3], std::cos(0.25), 1e-6);
  const std::optional<InstanceTransform> mirrored = decompose_instance(turned(0.5, {1, -1, 1}, {}));
  ASSERT_TRUE(mirrored);
  EXPECT_LT(mirrored->scale[0] * mirrored->scale[1] * mirrored->scale[2], 0.0f);
}

TEST(GltfInstances, ShearAndFlatMapsStayMatrices) {
  DAffine sheared(1.0);
  sheared[1].x = 0.01;
  EXPECT_FALSE(decompose_instance(sheared));
  EXPECT_FALSE(decompose_instance(turned(0.5, {1, 0, 1}, {})));
}

TEST(GltfInstances, RoundedValuesMoveNoCornerByMoreThanAStep) {
  const Bounds stored{DVec3(-300.0), DVec3(500.0)};
  for (const double smallest : {1.0, 1e-12}) { // the second needs floats: one exponent does not suit both sizes
    std::vector<DAffine> maps;
    for (int i = 0; i < 20; ++i)
      maps.push_back(turned(0.3 * i, DVec3(i == 7 ? smallest : 1.0 + 0.1 * i), {71.3 * i, -5.0, 0.01 * i}));
    GltfModel model;
    MeshoptStreams streams(model);
    GltfJson attributes;
    const double moved = InstanceAttributes(maps).add_coded(stored, streams, attributes);
    EXPECT_LE(moved, smallest == 1.0 ? 1.0 : 1e-3);
    EXPECT_EQ(attributes.size(), 3u);
    streams.finish();
    size_t without_filter = 0;
    for (const GltfJson& view : model.json()["bufferViews"])
      without_filter += !view["extensions"]["EXT_meshopt_compression"].contains("filter");
    EXPECT_EQ(without_filter > 0, smallest != 1.0);
  }
}

TEST(GltfInstances, ThoseOfAMeshShareANode) {
  Scene scene = test::scene_of(test::sphere_mesh(12));
  scene.shapes.clear();
  scene.objects.push_back({"ball", {Shape{0, 0, false, DAffine(1.0)}}});
  for (int i = 0; i < 5; ++i) scene.instances.push_back({0, Affine(turned(0.3 * i, DVec3(1.0 + i), {7.0 * i, 0, 0}))});
  scene.instances[3].world_from_object[1].x += 0.3f; // shears
  const BakedScene baked = test::bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  GltfConfig config = plain();
  const GltfExport apart = export_of(file, config);
  config.instancing = true;
  const GltfExport grouped = export_of(file, config);
  EXPECT_EQ(apart.report.grouped_instances, 0u);
  EXPECT_EQ(grouped.report.grouped_instances, scene.instances.size() - 1);
  const tinygltf::Model model = parse(grouped);
  EXPECT_EQ(model.extensionsRequired, std::vector<std::string>{"EXT_mesh_gpu_instancing"});
  size_t with_extension = 0;
  for (const tinygltf::Node& node : model.nodes) with_extension += node.extensions.count("EXT_mesh_gpu_instancing");
  EXPECT_EQ(with_extension, 1u);
}

} // namespace
} // namespace packtrace
