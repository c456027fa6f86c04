#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/format/trees/leaf_choice.h"
#include "compress/format/trees/node_writer.h"
#include "compress/format/trees/packed_trees.h"
#include "tests/compress/bvh/tree_walk.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using baked::PackedNode;
using baked::TreeRecord;

/// Builds the trees of a file and checks them: every triangle of a cluster that some ray sees is in exactly one leaf of
/// all trees, all other triangles in none.
PackedTrees check(const BakedFile& file) {
  PackedTrees built = build_packed_trees(file.sections());
  std::vector<std::vector<uint32_t>> seen;
  uint64_t nodes = 0;
  for (const TreeRecord& tree : built.trees) {
    EXPECT_EQ(tree.first_node, nodes);
    nodes += tree.node_count;
    const test::TreeWalk walk(file, tree, built.nodes);
    if (seen.empty()) seen.resize(walk.seen().size());
    for (size_t c = 0; c < seen.size(); ++c) {
      seen[c].resize(walk.seen()[c].size());
      for (size_t t = 0; t < seen[c].size(); ++t) seen[c][t] += walk.seen()[c][t];
    }
  }
  EXPECT_EQ(nodes, built.nodes.size());
  for (uint32_t g = 0; g < file.geometries().size(); ++g) {
    const baked::GeometryRecord& geometry = file.geometries()[g];
    for (uint32_t c = 0; c < geometry.cluster_count; ++c) {
      uint32_t material_class = 0;
      for (uint32_t end = geometry.class_clusters[0]; end <= c; end += geometry.class_clusters[++material_class]) {
      }
      const bool hit = (material_class & 3u) != 3u;
      const auto& triangles = seen[static_cast<size_t>(geometry.first_cluster) + c];
      EXPECT_EQ(triangles, std::vector<uint32_t>(triangles.size(), hit ? 1 : 0)) << "cluster " << c;
    }
  }
  return built;
}

BakedFile bake_file(const Scene& scene, const BakeConfig& config = {}) {
  return BakedFile::from_bytes(test::bake(scene, config).bytes);
}

TEST(PackedTrees, WorldSpaceGeometryHasOneTree) {
  Scene scene = test::scene_of(test::sphere_mesh(40));
  test::add_shape(scene, test::grid_mesh(30, 0.1f), test::translation({3, 0, 0}));
  const BakedFile file = bake_file(scene);
  const PackedTrees built = check(file);
  ASSERT_EQ(built.trees.size(), 1u);
  EXPECT_EQ(built.trees[0].geometry, baked::kWorldTree);
  uint64_t triangles = 0;
  for (const baked::ClusterRecord& cluster : file.sections().clusters) triangles += cluster.triangle_count;
  EXPECT_LE(built.nodes.size(), triangles / 20); // 4 bytes per triangle
}

TEST(PackedTrees, LargeTrianglesAmongSmallOnesGetNodesOfFew) {
  Scene scene = test::scene_of(test::grid_mesh(8, 0.3f));
  test::add_shape(scene, test::sphere_mesh(60, 0.01f));
  const PackedTrees built = check(bake_file(scene));
  uint32_t large = 0, nodes = 0;
  for (const PackedNode& node : built.nodes) {
    if (!node.has_leaves() || node.cluster > 0) continue;
    ++nodes;
    for (const uint8_t count : node.children) large += count;
  }
  ASSERT_EQ(large, 128u);
  EXPECT_GE(nodes, 20u) << nodes << ", and not two or three, as there are in clusters of usual size";
}

TEST(PackedTrees, InstancedGeometryHasTreesOfItsOwn) {
  Scene scene = test::scene_of(test::grid_mesh(10, 0.1f));
  const Mesh sphere = test::sphere_mesh(12);
  for (int i = 0; i < 3; ++i) test::add_shape(scene, sphere, test::translation({2.0 * i, 5, 0}));
  const BakedFile file = bake_file(scene);
  const PackedTrees built = check(file);
  ASSERT_EQ(built.trees.size(), 2u);
  EXPECT_EQ(built.trees[0].geometry, baked::kWorldTree);
  ASSERT_LT(built.trees[1].geometry, file.geometries().size());
  EXPECT_EQ(file.geometries()[built.trees[1].geometry].flags & baked::kWorldSpace, 0u);
}

TEST(PackedTrees, KeepsWhatEachKindOfRaySees) {
  Scene scene;
  scene.materials = {{"solid", 0, Vec3(0.5f), kNoMask, kNoMask, kNoTexture},
                     {"glass", kTransmissive, Vec3(0.5f), kNoMask, kNoMask, kNoTexture},
                     {"none", kInvisible, Vec3(0.5f), kNoMask, kNoMask, kNoTexture},
                     {"neither", kInvisible | kNoShadow, Vec3(0.5f), kNoMask, kNoMask, kNoTexture}};
  for (uint32_t m = 0; m < 4; ++m) test::add_shape(scene, test::grid_mesh(10), test::translation({2.0 * m, 0, 0}), m);
  const BakedFile file = bake_file(scene);
  const PackedTrees built = check(file);
  std::vector<uint8_t> classes;
  for (const PackedNode& node : built.nodes)
    if (node.has_leaves()) classes.push_back(node.ray_classes);
  std::sort(classes.begin(), classes.end());
  classes.erase(std::unique(classes.begin(), classes.end()), classes.end());
  EXPECT_EQ(classes, (std::vector<uint8_t>{1, 2, 3}));
}

TEST(PackedTrees, FineGeometryOfTheWorldKeepsItsDetail) {
  Scene scene = test::scene_of(test::sphere_mesh(40, 1000.0f));
  test::add_shape(scene, test::sphere_mesh(20, 0.001f)); // its finer lattice contains the lattice of the large sphere
  const BakedFile file = bake_file(scene);
  ASSERT_NE(file.geometries()[0].step_exponent, file.geometries()[1].step_exponent);
  const PackedTrees built = check(file);
  ASSERT_EQ(built.trees.size(), 1u);
  EXPECT_LE(built.trees[0].step_exponent,
            std::max(file.geometries()[0].step_exponent, file.geometries()[1].step_exponent));
}

TEST(PackedTrees, OriginMovesOnlyWhereThatIsExact) {
  const BakedFile far = bake_file(test::scene_of(test::sphere_mesh(20), test::translation({1000, 0, 1.5})));
  const PackedTrees built = check(far);
  EXPECT_NE(built.trees[0].origin[0], 0);
  EXPECT_EQ(built.trees[0].origin[1], 0);
  EXPECT_EQ(built.trees[0].origin[2], 0) << "one coordinate is five times another";
}

TEST(PackedTrees, WideLatticesAreHalvedUntilTheyFit) {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = 1e-10;
  const BakedFile file = bake_file(test::scene_of(test::sphere_mesh(16)), config);
  const PackedTrees built = check(file);
  EXPECT_GT(built.trees[0].step_exponent, file.geometries()[0].step_exponent);
}

TEST(PackedTrees, AreTheSameForAnyThreadCount) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene = test::scene_of(test::soup_mesh(20'000, 3));
  test::add_shape(scene, test::sphere_mesh(30));
  const BakedFile file = bake_file(scene);
  const PackedTrees first = check(file);
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
  const PackedTrees second = build_packed_trees(file.sections());
  ASSERT_EQ(second.nodes.size(), first.nodes.size());
  EXPECT_EQ(std::memcmp(second.nodes.data(), first.nodes.data(), first.nodes.size() * sizeof(PackedNode)), 0);
  EXPECT_EQ(std::memcmp(second.trees.data(), first.trees.data(), first.trees.size() * sizeof(TreeRecord)), 0);
}

TEST(PackedTrees, ASceneWithoutTrianglesHasNone) {
  Scene scene;
  EXPECT_TRUE(build_packed_trees(bake_file(scene).sections()).trees.empty());
}

TEST(NodeWriter, CoversTheWholeRange) {
  constexpr int32_t kMax = baked::kMaxTreeCoordinate;
  const std::vector<TreeGridBox> boxes{{{-kMax, 0, 7}, {-kMax, 0, 7}}, {{kMax, 0, 7}, {kMax, 255, 263}}};
  PackedNode node{};
  write_boxes(boxes, node);
  EXPECT_EQ(node.exponent(0), 23u);
  EXPECT_EQ(node.exponent(1), 0u);
  EXPECT_EQ(node.exponent(2), 1u);
  EXPECT_EQ(node.lo[0][0], 0);
  EXPECT_EQ(node.hi[1][1], 255);
  EXPECT_EQ(node.hi[2][1], 128);
  EXPECT_GE(node.origin[0] + (int64_t{node.hi[0][1]} << 23), kMax);
}

TEST(LeafNodes, EveryTriangleIsInOneLeafInOrder) {
  test::Random random(4);
  for (uint32_t count = 1; count <= 128; ++count)
    for (const bool flat : {false, true}) {
      std::vector<TreeGridBox> boxes(count);
      for (TreeGridBox& box : boxes)
        for (size_t axis = 0; axis < 3; ++axis) {
          box.lo[axis] = flat ? 5 : static_cast<int32_t>(random.uniform(-1000.0f, 1000.0f));
          box.hi[axis] = flat ? 5 : box.lo[axis] + static_cast<int32_t>(random.uniform(0.0f, 300.0f));
        }
      std::vector<LeafNode> nodes;
      TreeGridBox whole = boxes[0];
      for (const TreeGridBox& box : boxes) whole.extend(box);
      find_leaf_nodes(boxes, {}, typical_node_area(half_area(sweep_box(whole)), count), nodes);
      uint32_t next = 0;
      for (const LeafNode& node : nodes) {
        EXPECT_EQ(node.first_triangle, next);
        ASSERT_LE(node.leaf_count, baked::kNodeWidth);
        for (uint32_t i = 0; i < node.leaf_count; ++i) {
          EXPECT_GE(node.triangles[i], 1);
          EXPECT_LE(node.triangles[i], baked::kMaxLeafTriangles);
          next += node.triangles[i];
        }
      }
      EXPECT_EQ(next, count);
      if (flat) {
        EXPECT_LE(nodes.size(), (count + 63) / 64);
      } // the leaves are at least half full
    }
}

} // namespace
} // namespace packtrace
