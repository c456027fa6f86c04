#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/trees/packed_trees.h"
#include "compress/format/trees/tree_topology.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using baked::PackedNode;
using baked::TreeRecord;
using test::message_after;

/// World-space geometry with two materials, and an instanced sphere.
Scene scene_with_trees() {
  Scene scene = test::scene_of(test::sphere_mesh(30));
  scene.materials.push_back({"glass", kTransmissive, Vec3(0.5f), kNoMask, kNoMask});
  test::add_shape(scene, test::grid_mesh(20, 0.2f), test::translation({3, 0, 0}), 1);
  const Mesh ball = test::sphere_mesh(12, 0.3f);
  for (int i = 0; i < 2; ++i) test::add_shape(scene, ball, test::translation({0, 3.0 + i, 0}));
  return scene;
}

template <typename T>
bool same_bytes(std::span<const T> a, std::span<const T> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

TEST(TreeFile, HoldsWhatTheBuilderMakes) {
  const BakedFile file = BakedFile::from_bytes(test::bake(scene_with_trees()).bytes);
  const PackedTrees built = build_packed_trees(file.sections());
  ASSERT_EQ(built.trees.size(), 2u);
  EXPECT_TRUE(same_bytes<TreeRecord>(file.sections().trees, built.trees));
  EXPECT_TRUE(same_bytes<PackedNode>(file.sections().nodes, built.nodes));
}

TEST(TreeFile, HoldsNoneWhereNoneAreWanted) {
  BakeConfig config;
  config.trees = false;
  for (const PageCodec codec : {PageCodec::kNone, PageCodec::kFast, PageCodec::kSmall}) {
    config.codec = codec;
    const BakedFile file = BakedFile::from_bytes(test::bake(scene_with_trees(), config).bytes);
    EXPECT_TRUE(file.sections().trees.empty());
    EXPECT_TRUE(file.sections().nodes.empty());
  }
}

TEST(TreeFile, TopologyGivesTheNodesBack) {
  Scene scene = scene_with_trees();
  test::add_shape(scene, test::soup_mesh(3000, 5));
  const BakedFile file = BakedFile::from_bytes(test::bake(scene).bytes);
  const std::vector<uint8_t> topology = pack_tree_topology(file.sections());
  EXPECT_LT(topology.size(), 20 * file.sections().nodes.size());
  std::vector<PackedNode> nodes(file.sections().nodes.size());
  ASSERT_TRUE(restore_nodes(file.sections(), topology, nodes));
  EXPECT_TRUE(same_bytes<PackedNode>(nodes, file.sections().nodes));
}

TEST(TreeFile, DamagedTopologyIsRefusedOrMakesNodesThatFit) {
  const BakedFile file = BakedFile::from_bytes(test::bake(scene_with_trees()).bytes);
  const std::vector<uint8_t> topology = pack_tree_topology(file.sections());
  std::vector<PackedNode> nodes(file.sections().nodes.size());
  for (size_t size = 0; size < topology.size(); ++size)
    ASSERT_FALSE(restore_nodes(file.sections(), std::span(topology).first(size), nodes)) << size;
  test::Random random(6);
  uint32_t refused = 0, accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    std::vector<uint8_t> bytes = topology;
    bytes[random.bits() % bytes.size()] = static_cast<uint8_t>(random.bits());
    ++(restore_nodes(file.sections(), bytes, nodes) ? accepted : refused);
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(accepted, 10u);
}

/// A file, and the error messages that it is refused with after changes.
class TreeDamage : public testing::Test {
protected:
  TreeDamage() : bytes_(test::bake(scene_with_trees()).bytes), file_(BakedFile::from_bytes(bytes_)) {
    const auto nodes = file_.sections().nodes;
    while (leaf_ < nodes.size() && !nodes[leaf_].has_leaves()) ++leaf_;
  }
  std::string tree(size_t number, size_t field, uint32_t value) const {
    return message(baked::kTrees, number * sizeof(TreeRecord) + field, value);
  }
  std::string node(size_t number, size_t field, uint32_t value) const {
    return message(baked::kNodes, number * sizeof(PackedNode) + field, value);
  }
  const PackedNode& node(size_t number) const { return file_.sections().nodes[number]; }
  size_t leaf() const { return leaf_; } ///< the first leaf node
  const BakedFile& file() const { return file_; }

private:
  std::string message(baked::Section section, size_t at, uint32_t value) const {
    const std::string text = message_after(bytes_, section, at, value), start = "memory: damaged baked file: ";
    EXPECT_TRUE(text.starts_with(start)) << text;
    return text.substr(std::min(start.size(), text.size()));
  }

  std::vector<std::byte> bytes_;
  BakedFile file_;
  size_t leaf_ = 0;
};

TEST_F(TreeDamage, RecordsAreChecked) {
  const uint32_t nodes = file().sections().trees[0].node_count;
  EXPECT_EQ(tree(0, offsetof(TreeRecord, first_node), 1), "tree 0: node range");
  EXPECT_EQ(tree(1, offsetof(TreeRecord, first_node), nodes + 1), "tree 1: node range");
  EXPECT_EQ(tree(1, offsetof(TreeRecord, node_count), ~0u), "tree 1: node range");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, depth), 49), "tree 0: depth or reserved field");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, depth), 40), "tree 0: depth");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, reserved), 1), "tree 0: depth or reserved field");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, geometry), 77), "tree 0: geometry");
  EXPECT_EQ(tree(1, offsetof(TreeRecord, geometry), baked::kWorldTree), "tree 1: geometry");
  // The ball's lattice does not fit.
  EXPECT_EQ(tree(1, offsetof(TreeRecord, geometry), 0), "geometry 0: lattice beyond that of its tree");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, step_mantissa), 7), "tree 0: step");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, step_exponent), 5000), "tree 0: step");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, origin) + 4, 1u << 30), "tree 0: origin");
  EXPECT_EQ(tree(0, offsetof(TreeRecord, origin) + 4, 1), "geometry 0: lattice beyond that of its tree");
}

TEST_F(TreeDamage, NodesAreChecked) {
  const std::string root = "node 0: ";
  EXPECT_EQ(node(0, offsetof(PackedNode, exponents), 0x8000u), root + "exponents");
  EXPECT_EQ(node(0, offsetof(PackedNode, exponents), 24), root + "exponents");
  EXPECT_EQ(node(0, offsetof(PackedNode, origin), 1u << 30), root + "origin");
  EXPECT_EQ(node(0, offsetof(PackedNode, origin), uint32_t(baked::kMaxTreeCoordinate)), root + "boxes");
  EXPECT_EQ(node(0, offsetof(PackedNode, first_child), 0), root + "child numbers");
  EXPECT_EQ(node(0, offsetof(PackedNode, first_child), ~0u), root + "child numbers");
  EXPECT_EQ(node(0, offsetof(PackedNode, first_child), 2), "node 1: no parent");
  EXPECT_EQ(node(0, offsetof(PackedNode, cluster), 1), root + "children");
  EXPECT_EQ(node(0, offsetof(PackedNode, children), 0), root + "no children");
  EXPECT_EQ(node(0, offsetof(PackedNode, children) + 4, 0xffffff10u), root + "children");
  EXPECT_EQ(node(0, offsetof(PackedNode, lo), 0x000000ffu), root + "boxes");
}

TEST_F(TreeDamage, LeavesAreChecked) {
  const std::string at = "node " + std::to_string(leaf()) + ": ";
  EXPECT_EQ(node(leaf(), offsetof(PackedNode, cluster), ~0u), at + "cluster");
  EXPECT_EQ(node(leaf(), offsetof(PackedNode, cluster), static_cast<uint32_t>(file().geometries()[2].first_cluster)),
            at + "cluster");
  EXPECT_EQ(node(leaf(), offsetof(PackedNode, first_child), 1), at + "child numbers");
  uint32_t children;
  std::memcpy(&children, node(leaf()).children.data(), sizeof children);
  EXPECT_EQ(node(leaf(), offsetof(PackedNode, children), (children & ~0xffu) | 17u), at + "leaves");
  uint32_t shift = 0; // of a leaf that may lose a triangle
  while (shift < 24 && ((children >> shift) & 0xffu) <= 1) shift += 8;
  ASSERT_GT((children >> shift) & 0xffu, 1u);
  const uint32_t fewer = children - (1u << shift);
  EXPECT_NE(node(leaf(), offsetof(PackedNode, children), fewer).find("triangles that no leaf holds"),
            std::string::npos);
}

} // namespace
} // namespace packtrace
