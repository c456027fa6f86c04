#include <cmath>
#include <deque>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/bvh/box_tree.h"
#include "compress/bvh/wide_tree.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

bool contains(const TreeBox& outer, const TreeBox& inner) {
  for (size_t axis = 0; axis < 3; ++axis)
    if (!(outer.lo[axis] <= inner.lo[axis] && outer.hi[axis] >= inner.hi[axis])) return false;
  return true;
}

std::vector<TreeBox> random_boxes(uint32_t count, float size, uint32_t seed) {
  test::Random random(seed);
  std::vector<TreeBox> boxes(count);
  for (TreeBox& box : boxes)
    for (size_t axis = 0; axis < 3; ++axis) {
      box.lo[axis] = random.uniform(-1.0f, 1.0f);
      box.hi[axis] = box.lo[axis] + random.uniform(0.0f, size);
    }
  return boxes;
}

/// Levels of the subtree, having checked that it is one over exactly order[first .. first + count).
uint32_t check_subtree(const BoxTree& tree, std::span<const TreeBox> boxes, uint32_t number) {
  const BoxTreeNode& node = tree.nodes[number];
  for (uint32_t i = 0; i < node.count; ++i)
    EXPECT_TRUE(contains(node.box, boxes[tree.order[node.first + i]])) << number;
  if (node.count == 1) {
    EXPECT_EQ(node.right, 0u);
    return 1;
  }
  const BoxTreeNode &left = tree.nodes[number + 1], &right = tree.nodes[node.right];
  EXPECT_EQ(left.first, node.first);
  EXPECT_EQ(right.first, left.first + left.count);
  EXPECT_EQ(left.count + right.count, node.count);
  return 1 + std::max(check_subtree(tree, boxes, number + 1), check_subtree(tree, boxes, node.right));
}

uint32_t check_tree(const BoxTree& tree, std::span<const TreeBox> boxes) {
  EXPECT_EQ(tree.nodes.size(), 2 * boxes.size() - 1);
  EXPECT_EQ(tree.nodes[0].count, boxes.size());
  std::vector<uint32_t> seen(boxes.size());
  for (const uint32_t i : tree.order) ++seen[i];
  EXPECT_EQ(seen, std::vector<uint32_t>(boxes.size(), 1));
  return check_subtree(tree, boxes, 0);
}

TEST(BoxTree, HoldsEveryBoxOnce) {
  for (const uint32_t count : {1u, 2u, 3u, 7u, 100u, 10'000u}) {
    SCOPED_TRACE(count);
    const std::vector<TreeBox> boxes = random_boxes(count, 0.1f, count);
    EXPECT_LE(check_tree(build_box_tree(boxes), boxes), 40u);
  }
  EXPECT_TRUE(build_box_tree({}).nodes.empty());
}

TEST(BoxTree, SeparatesWhatIsApart) {
  // Two heaps far apart: the first split is between them.
  std::vector<TreeBox> boxes = random_boxes(200, 0.1f, 1);
  for (size_t i = 0; i < boxes.size(); i += 2) boxes[i].lo[1] += 10.0f, boxes[i].hi[1] += 10.0f;
  const BoxTree tree = build_box_tree(boxes);
  EXPECT_EQ(tree.nodes[1].count, 100u);
  EXPECT_LT(tree.nodes[1].box.hi[1], 2.0f);
  EXPECT_GT(tree.nodes[tree.nodes[0].right].box.lo[1], 8.0f);
}

TEST(BoxTree, EndsOnEqualAndExtremeBoxes) {
  constexpr float kMax = std::numeric_limits<float>::max(), kDenormal = std::numeric_limits<float>::denorm_min();
  std::deque<std::vector<TreeBox>> cases;                  // keeps them in place
  cases.emplace_back(5000, TreeBox{{1, 2, 3}, {1, 2, 3}}); // equal points
  cases.emplace_back(5000, TreeBox{{-kMax, -kMax, -kMax}, {kMax, kMax, kMax}});
  std::vector<TreeBox>& growing = cases.emplace_back(); // each split takes one off
  for (int i = 0; i < 250; ++i) {
    const float x = std::ldexp(1.0f, i - 125);
    growing.push_back({{x, 0, 0}, {x, 0, 0}});
  }
  std::vector<TreeBox>& tiny = cases.emplace_back();
  for (int i = 0; i < 100; ++i) tiny.push_back({{kDenormal * static_cast<float>(i), 0, 0}, {kDenormal * 100.0f, 0, 0}});
  std::vector<TreeBox>& ends = cases.emplace_back();
  for (int i = 0; i < 100; ++i)
    ends.push_back(i % 2 ? TreeBox{{kMax, 0, 0}, {kMax, 0, 0}} : TreeBox{{-kMax, 0, 0}, {-kMax, 0, 0}});
  for (size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(i);
    const std::vector<TreeBox>& boxes = cases[i];
    EXPECT_LE(check_tree(build_box_tree(boxes, 40), boxes), 40u);
  }
  EXPECT_LE(check_tree(build_box_tree(growing, 33), growing), 33u);
}

bool same(const BoxTree& a, const BoxTree& b) {
  if (a.order != b.order || a.nodes.size() != b.nodes.size()) return false;
  for (size_t i = 0; i < a.nodes.size(); ++i)
    if (a.nodes[i].box.lo != b.nodes[i].box.lo || a.nodes[i].box.hi != b.nodes[i].box.hi ||
        a.nodes[i].right != b.nodes[i].right)
      return false;
  return true;
}

TEST(BoxTree, IsTheSameForAnyThreadCount) {
  const std::vector<TreeBox> boxes = random_boxes(50'000, 0.02f, 9);
  const BoxTree tree = build_box_tree(boxes);
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_TRUE(same(build_box_tree(boxes), tree));
}

/// Levels below and with a node, having counted the boxes.
uint32_t check_wide(const BoxTree& binary, std::span<const WideNode> wide, uint32_t number,
                    std::vector<uint32_t>& seen) {
  const WideNode& node = wide[number];
  if (node.child_count == 0) {
    EXPECT_EQ(binary.nodes[node.source].count, 1u);
    ++seen[binary.order[binary.nodes[node.source].first]];
    return 1;
  }
  EXPECT_GE(node.child_count, 2u);
  EXPECT_LE(node.child_count, kWideTreeWidth);
  EXPECT_GT(node.first_child, number);
  uint32_t below = 0;
  for (uint32_t i = 0; i < node.child_count; ++i) {
    EXPECT_TRUE(contains(binary.nodes[node.source].box, binary.nodes[wide[node.first_child + i].source].box));
    below = std::max(below, check_wide(binary, wide, node.first_child + i, seen));
  }
  return below + 1;
}

TEST(WideTree, HoldsEveryBoxOnceInFewNodes) {
  EXPECT_TRUE(collapse_box_tree({}).empty());
  for (const uint32_t count : {1u, 2u, 8u, 9u, 64u, 1000u, 20'000u}) {
    SCOPED_TRACE(count);
    const std::vector<TreeBox> boxes = random_boxes(count, 0.05f, count);
    const BoxTree binary = build_box_tree(boxes);
    const std::vector<WideNode> wide = collapse_box_tree(binary);
    std::vector<uint32_t> seen(count);
    check_wide(binary, wide, 0, seen);
    EXPECT_EQ(seen, std::vector<uint32_t>(count, 1));
    EXPECT_LE(wide.size() - count, 1 + count * 2 / 5); // one for each 3.5 of 8 children
    if (count <= 8 && count > 1) {
      EXPECT_EQ(wide.size(), count + 1);
    }
  }
}

TEST(WideTree, BoxesWithoutAreaGetFewNodesToo) {
  std::vector<TreeBox> boxes(1000, TreeBox{{1, 2, 3}, {1, 2, 3}});
  EXPECT_LE(collapse_box_tree(build_box_tree(boxes)).size(), 1000u + 250);
  for (size_t i = 0; i < boxes.size(); ++i) boxes[i].lo[0] = boxes[i].hi[0] = static_cast<float>(i); // on a line
  EXPECT_LE(collapse_box_tree(build_box_tree(boxes)).size(), 1000u + 250);
}

} // namespace
} // namespace packtrace
