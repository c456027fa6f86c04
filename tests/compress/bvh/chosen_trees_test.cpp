#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/format/trees/node_writer.h"
#include "compress/format/trees/packed_trees.h"
#include "compress/format/trees/stored_nodes.h"
#include "tests/compress/bvh/tree_walk.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using baked::PackedNode;
using baked::TreeRecord;

/// Two world-space geometries on different lattices, far from the origin, and an instanced one; all with LOD levels.
Scene scene_of_levels() {
  Scene scene = test::scene_of(test::sphere_mesh(60, 40.0f), test::translation({1000, 1, 1}));
  test::add_shape(scene, test::sphere_mesh(50, 0.01f), test::translation({1040, 1, 1}));
  const Mesh shared = test::sphere_mesh(40);
  for (int i = 0; i < 3; ++i) test::add_shape(scene, shared, test::translation({2.0 * i, 5, 0}));
  return scene;
}

BakedFile bake_levels(const Scene& scene) {
  BakeConfig config;
  config.lod = LodUse::kAll;
  config.lod_min_triangles = 1;
  return BakedFile::from_bytes(test::bake(scene, config).bytes);
}

/// One choice for the world and one for each other geometry. Each contains the clusters of all levels for which `take`
/// returns true.
template <typename Take>
std::vector<ChosenClusters> choose(const BakedFile& file, Take take) {
  const BakedSections& sections = file.sections();
  const std::vector<uint8_t> joins = ChosenTreeBuilder::joins_world(sections);
  std::vector<ChosenClusters> chosen{{baked::kWorldTree, {}}};
  const auto add = [&](uint32_t geometry, std::vector<uint32_t>& clusters) {
    const baked::GeometryRecord& record = sections.geometries[geometry];
    for (uint32_t c = 0; c < record.cluster_count; ++c)
      if (take(geometry, c)) clusters.push_back(static_cast<uint32_t>(record.first_cluster) + c);
  };
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g) {
    if (joins[g] == 0) chosen.push_back({g, {}});
    std::vector<uint32_t>& clusters = (joins[g] != 0 ? chosen.front() : chosen.back()).clusters;
    add(g, clusters);
    for (const baked::LodLevelRecord& level : file.lod(g).levels)
      if (level.level > 0) add(level.geometry, clusters);
    std::ranges::sort(clusters);
  }
  return chosen;
}

bool same(const PackedTrees& a, const PackedTrees& b) {
  return a.trees.size() == b.trees.size() && a.nodes.size() == b.nodes.size() &&
         std::memcmp(a.trees.data(), b.trees.data(), a.trees.size() * sizeof(TreeRecord)) == 0 &&
         std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(PackedNode)) == 0;
}

BakedSections without_trees(BakedSections sections) {
  sections.trees = {}, sections.nodes = {};
  return sections;
}

TEST(ChosenTrees, OfAllClustersAreThoseOfTheWholeFile) {
  Scene scene = scene_of_levels();
  const BakedFile file = BakedFile::from_bytes(test::bake(scene, {}).bytes);
  const std::vector<ChosenClusters> chosen = choose(file, [](uint32_t, uint32_t) { return true; });
  const PackedTrees expected = build_packed_trees(file.sections());
  ASSERT_EQ(expected.trees.size(), 2u);
  EXPECT_TRUE(same(ChosenTreeBuilder(file.sections(), chosen).build(), expected));
}

/// Bytes of all leaf nodes.
std::multiset<std::string> leaf_nodes_of(const PackedTrees& trees) {
  std::multiset<std::string> nodes;
  for (const baked::PackedNode& node : trees.nodes)
    if (node.has_leaves()) nodes.emplace(reinterpret_cast<const char*>(&node), sizeof node);
  return nodes;
}

TEST(ChosenTrees, NodesOfAFileWithoutTreesDoNotDependOnTheChoice) {
  const BakedFile file = BakedFile::from_bytes(test::bake(scene_of_levels(), {}).bytes);
  const BakedSections none = without_trees(file.sections());
  const std::multiset<std::string> expected = leaf_nodes_of(build_packed_trees(file.sections()));
  const auto nodes_of = [&](const auto& take) {
    return leaf_nodes_of(ChosenTreeBuilder(none, choose(file, take)).build());
  };
  EXPECT_EQ(nodes_of([](uint32_t, uint32_t) { return true; }), expected);
  const std::multiset<std::string> some = nodes_of([](uint32_t, uint32_t cluster) { return cluster % 3 == 0; });
  EXPECT_GT(some.size(), 4u);
  EXPECT_LT(some.size(), expected.size());
  EXPECT_TRUE(std::ranges::includes(expected, some));
}

TEST(ChosenTrees, HoldEachTriangleOnceWhereverTheirNodesComeFrom) {
  const BakedFile file = bake_levels(scene_of_levels());
  const BakedSections none = without_trees(file.sections());
  ASSERT_GT(file.geometries().size(), file.base_geometry_count() + 3);
  const auto take = [](uint32_t geometry, uint32_t cluster) { return (geometry + cluster) % 3 != 0; };
  const std::vector<ChosenClusters> chosen = choose(file, take);
  for (const BakedSections* sections : {&file.sections(), &none}) {
    const ChosenTreeBuilder builder(*sections, chosen);
    const PackedTrees built = builder.build();
    ASSERT_EQ(built.trees.size(), chosen.size());
    for (size_t i = 0; i < chosen.size(); ++i) {
      const test::TreeWalk walk(file, built.trees[i], built.nodes, 2.0);
      for (uint32_t c = 0; c < walk.seen().size(); ++c) {
        const uint32_t expected = std::ranges::binary_search(chosen[i].clusters, c) ? 1 : 0;
        EXPECT_EQ(walk.seen()[c], std::vector<uint32_t>(walk.seen()[c].size(), expected)) << c;
      }
      EXPECT_GT(builder.leaf_nodes(i), 4u);
      EXPECT_LE(built.trees[i].node_count, 2 * builder.leaf_nodes(i) - 1);
    }
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_TRUE(same(ChosenTreeBuilder(*sections, chosen).build(), built));
  }
}

TEST(ChosenTrees, TakeNodesFromTheFile) {
  const BakedFile file = bake_levels(scene_of_levels());
  // Trees with one triangle per leaf, which no builder would make, so that reused nodes are recognisable.
  TreeCosts costs;
  costs.max_leaf_triangles = 1;
  const PackedTrees odd = build_packed_trees(file.sections(), costs);
  BakedSections sections = file.sections();
  sections.trees = odd.trees, sections.nodes = odd.nodes;
  const std::vector<ChosenClusters> chosen =
      choose(file, [](uint32_t geometry, uint32_t cluster) { return (geometry + cluster) % 2 != 0; });
  const PackedTrees built = ChosenTreeBuilder(sections, chosen).build();
  uint32_t moved = 0, rescaled = 0;
  for (const TreeRecord& tree : built.trees) {
    const test::TreeWalk walk(file, tree, built.nodes, 2.0);
    for (const TreeRecord& from : odd.trees)
      if (from.geometry == tree.geometry)
        moved += from.origin != tree.origin, rescaled += from.step_exponent != tree.step_exponent;
    for (uint32_t i = 0; i < tree.node_count; ++i) {
      const PackedNode& node = built.nodes[static_cast<size_t>(tree.first_node) + i];
      if (!node.has_leaves()) continue;
      EXPECT_TRUE(std::ranges::all_of(node.children, [](uint8_t count) { return count <= 1; }));
    }
  }
  EXPECT_GT(moved + rescaled, 0u);
}

/// A node of random boxes around a point.
PackedNode random_node(test::Random& random, int32_t about) {
  std::vector<TreeGridBox> boxes(1 + static_cast<size_t>(random.uniform(0.0f, 7.9f)));
  for (TreeGridBox& box : boxes)
    for (size_t axis = 0; axis < 3; ++axis) {
      box.lo[axis] = about + static_cast<int32_t>(random.uniform(-1e6f, 1e6f));
      box.hi[axis] = box.lo[axis] + static_cast<int32_t>(random.uniform(0.0f, 1e5f));
    }
  PackedNode node{};
  std::fill_n(node.children.begin(), boxes.size(), uint8_t{3});
  write_boxes(boxes, node);
  return node;
}

TEST(NodeGridTransfer, HoldsWhatWasThereAndLittleMore) {
  test::Random random(9);
  for (const int32_t doublings : {-7, -1, 0, 1, 6})
    for (int round = 0; round < 200; ++round) {
      TreeRecord from{}, to{};
      from.step_mantissa = to.step_mantissa = kMinStepMantissa;
      to.step_exponent = -doublings;
      from.origin = {1 << 20, -77, 0}, to.origin = {(1 << 22) + 3, 0, round - 100};
      const PackedNode node = random_node(random, round);
      PackedNode out;
      const NodeGridTransfer move(from, to);
      ASSERT_EQ(move.exact(), doublings == 0);
      const std::optional<TreeGridBox> whole = move.move(node, out);
      ASSERT_TRUE(whole);
      EXPECT_EQ(out.children, node.children);
      for (uint32_t axis = 0; axis < 3; ++axis)
        for (uint32_t child = 0; child < 8 && node.children[child] != 0; ++child) {
          const auto moved = [&](uint8_t end) {
            const auto p =
                static_cast<double>(from.origin[axis] + node.origin[axis] + (int64_t{end} << node.exponent(axis)));
            return std::ldexp(p, doublings) - static_cast<double>(to.origin[axis]);
          };
          const double lo = moved(node.lo[axis][child]), hi = moved(node.hi[axis][child]);
          const auto there = [&](uint8_t end) {
            return static_cast<double>(out.origin[axis] + (int64_t{end} << out.exponent(axis)));
          };
          const double unit = doublings == 0 ? 0.0 : std::ldexp(1.0, static_cast<int>(out.exponent(axis))) + 1.0;
          EXPECT_LE(there(out.lo[axis][child]), lo);
          EXPECT_GE(there(out.hi[axis][child]), hi);
          EXPECT_GE(there(out.lo[axis][child]), lo - unit);
          EXPECT_LE(there(out.hi[axis][child]), hi + unit);
          EXPECT_LE(whole->lo[axis], lo);
          EXPECT_GE(whole->hi[axis], hi);
        }
    }
}

TEST(NodeGridTransfer, RefusesWhatCannotBe) {
  test::Random random(3);
  TreeRecord from{}, to{};
  from.step_mantissa = to.step_mantissa = kMinStepMantissa;
  const PackedNode node = random_node(random, 0);
  PackedNode out;
  EXPECT_TRUE(NodeGridTransfer(from, to).move(node, out));
  to.origin[1] = int64_t{1} << 60; // beyond the tree coordinates at any scale
  from.origin[1] = -to.origin[1];
  EXPECT_FALSE(NodeGridTransfer(from, to).move(node, out));
  to.step_exponent = -60;
  EXPECT_FALSE(NodeGridTransfer(from, to).move(node, out));
  from.origin = to.origin = {};
  EXPECT_FALSE(NodeGridTransfer(from, to).move(node, out));
  to.step_exponent = 61;
  EXPECT_FALSE(NodeGridTransfer(from, to).move(node, out));
  to.step_exponent = 0, to.step_mantissa = kMinStepMantissa + 1;
  EXPECT_FALSE(NodeGridTransfer(from, to).move(node, out));
}

} // namespace
} // namespace packtrace
