#include <cstring>

#include <gtest/gtest.h>

#include "compress/format/trees/packed_trees.h"
#include "runtime/trace/packed/scene/trace_cluster.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

/// Decodes every run of up to 16 triangles of every cluster as batches, and the first triangle of each run alone.
/// Returns the number of batches that differ from decode_batch_exactly().
size_t wrong_batches(const BakedFile& file, const packed::Kernels& kernels, size_t& batches) {
  const PackedTrees trees = build_packed_trees(file.sections());
  size_t wrong = 0;
  for (const baked::TreeRecord& tree : trees.trees) {
    const uint32_t g = tree.geometry == baked::kWorldTree ? 0 : tree.geometry;
    const baked::GeometryRecord& geometry = file.geometries()[g];
    for (uint32_t c = 0; c < geometry.cluster_count; ++c) {
      const ClusterView view = file.cluster(g, c);
      const packed::TraceCluster cluster = trace_cluster(tree, geometry, view, baked::kVisibleToCamera);
      if ((cluster.flags & packed::kNeedsWideDecode) != 0) continue;
      for (uint32_t first = 0; first < view.triangle_count(); ++first)
        for (uint32_t count = 1; count <= std::min(view.triangle_count() - first, 16u); ++count) {
          packed::DecodedBatch decoded{}, expected{};
          const uint32_t got = kernels.decode(cluster, first, count, decoded);
          decode_batch_exactly(tree, geometry, view, first, got, expected);
          bool same = got >= 1 && got <= std::min(count, packed::kBatch) && decoded.count == got;
          float vertices[3][3];
          kernels.triangle(cluster, first, vertices);
          for (int axis = 0; axis < 3; ++axis)
            for (int corner = 0; corner < 3; ++corner)
              same &= vertices[corner][axis] == expected.vertex[axis][corner][0];
          for (uint32_t i = 0; i < got; ++i)
            for (uint32_t axis = 0; axis < 3; ++axis)
              for (uint32_t corner = 0; corner < 3; ++corner)
                same &= decoded.vertex[axis][corner][i] == expected.vertex[axis][corner][i];
          wrong += same ? 0 : 1;
          ++batches;
        }
    }
  }
  return wrong;
}

class PackedDecode : public testing::TestWithParam<PackedIsa> {
protected:
  void SetUp() override {
    if (!isa_supported(GetParam())) GTEST_SKIP() << "this machine lacks the instruction set";
  }
};

TEST_P(PackedDecode, ReadsEveryRunOfTriangles) {
  Scene scene;
  test::add_shape(scene, test::sphere({1, 2, 3}, 1.5f, 40));
  const test::BakedScene baked(scene);
  size_t batches = 0;
  EXPECT_EQ(wrong_batches(baked.file, kernels_of(GetParam()), batches), 0u);
  EXPECT_GT(batches, 50000u);
}

TEST_P(PackedDecode, ReadsLooseTriangles) {
  // Random triangles over 60 vertices: mostly strips of one triangle, with many explicit vertex numbers.
  std::mt19937 generator(3);
  Mesh mesh;
  for (int i = 0; i < 60; ++i) {
    const auto coordinate = [&] { return static_cast<float>(generator() % 1000); };
    const float x = coordinate(), y = coordinate(), z = coordinate();
    mesh.positions.emplace_back(x, y, z);
  }
  for (int i = 0; i < 400; ++i) {
    const auto vertex = [&] { return static_cast<uint32_t>(generator() % 60); };
    const uint32_t a = vertex(), b = vertex(), c = vertex();
    if (a != b && b != c && c != a) mesh.triangles.emplace_back(a, b, c);
  }
  Scene scene;
  test::add_shape(scene, mesh);
  const test::BakedScene baked(scene);
  size_t batches = 0;
  EXPECT_EQ(wrong_batches(baked.file, kernels_of(GetParam()), batches), 0u);
  EXPECT_GT(batches, 3000u);
}

INSTANTIATE_TEST_SUITE_P(Isas, PackedDecode, testing::Values(PackedIsa::kScalar, PackedIsa::kAvx2, PackedIsa::kAvx512));

TEST(TraceCluster, LeavesWhatDoesNotFitToTheExactDecoder) {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 16));
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = 1e-8; // 28 or more bits per axis
  const test::BakedScene baked(scene, config);
  const PackedTrees trees = build_packed_trees(baked.file.sections());
  const packed::TraceCluster cluster =
      trace_cluster(trees.trees[0], baked.file.geometries()[0], baked.file.cluster(0, 0), baked::kVisibleToCamera);
  EXPECT_TRUE((cluster.flags & packed::kNeedsWideDecode) != 0);
  for (const PackedIsa isa : test::isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    Ray ray; // from the centre outwards
    ray.direction = Vec3(0.3f, 0.5f, -0.2f);
    const RayHit hit = test::closest(tracer, {&ray, 1})[0];
    ASSERT_TRUE(hit.valid());
    EXPECT_NEAR(double{hit.t} * glm::length(DVec3(ray.direction)) / tracer.space().scale(), 1.0, 0.02);
  }
}

TEST(TraceCluster, LeavesCoordinatesBeyond32BitsToTheExactDecoder) {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 16));
  const test::BakedScene sphere(scene);
  baked::TreeRecord tree = build_packed_trees(sphere.file.sections()).trees[0];
  const auto cluster = [&] {
    return trace_cluster(tree, sphere.file.geometries()[0], sphere.file.cluster(0, 0), baked::kVisibleToCamera);
  };
  const packed::TraceCluster near = cluster();
  ASSERT_EQ(near.flags & packed::kNeedsWideDecode, 0);
  ASSERT_GT(near.position_bits[0], near.down + 1);
  // Moves the lowest x to the largest 32-bit integer, or to less than a step of the tree's grid below it.
  tree.origin[0] -= (int64_t{std::numeric_limits<int32_t>::max()} - near.base[0]) >> near.down;
  EXPECT_NE(cluster().flags & packed::kNeedsWideDecode, 0);
}

} // namespace
} // namespace packtrace
