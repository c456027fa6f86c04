#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/trees/reinsertion.h"
#include "compress/format/trees/wide_tree.h"
#include "tests/compress/bvh/box_checks.h"

namespace packtrace {
namespace {

using test::check_tree, test::random_boxes;

double inner_area(const BoxTree& tree) {
  double sum = 0.0;
  for (const BoxTreeNode& node : tree.nodes)
    if (node.count > 1) sum += node.box.half_area();
  return sum;
}

/// Small boxes, and a few as large as all small ones together. Splits by centres leave the large boxes among the small
/// ones.
std::vector<TreeBox> boxes_of_many_sizes() {
  std::vector<TreeBox> boxes = random_boxes(2000, 0.01f, 1);
  for (const TreeBox& box : random_boxes(200, 2.0f, 2)) boxes.push_back(box);
  return boxes;
}

TEST(Reinsertion, MakesInnerNodesSmaller) {
  const std::vector<TreeBox> boxes = boxes_of_many_sizes();
  const BoxTree before = build_box_tree(boxes);
  BoxTree tree = before;
  reinsert_subtrees(tree);
  check_tree(tree, boxes);
  EXPECT_LT(inner_area(tree), 0.8 * inner_area(before));
}

TEST(Reinsertion, FindsTheMovesThatATreeNeeds) {
  // Two pairs, and a tree with one box of each pair on either side. Moving one subtree repairs one side, moving another
  // one repairs the other.
  const std::vector<TreeBox> boxes{
      {{0, 0, 0}, {1, 1, 1}}, {{9, 0, 0}, {10, 1, 1}}, {{0, 0, 1}, {1, 1, 2}}, {{9, 0, 1}, {10, 1, 2}}};
  BoxTree tree;
  tree.order = {0, 1, 2, 3};
  const auto leaf = [&](uint32_t box) { return BoxTreeNode{boxes[box], box, 1, 0}; };
  tree.nodes = {{{{0, 0, 0}, {10, 1, 2}}, 0, 4, 4},
                {{{0, 0, 0}, {10, 1, 1}}, 0, 2, 3},
                leaf(0),
                leaf(1),
                {{{0, 0, 1}, {10, 1, 2}}, 2, 2, 6},
                leaf(2),
                leaf(3)};
  ASSERT_EQ(check_tree(tree, boxes), 3u);
  reinsert_subtrees(tree);
  EXPECT_EQ(check_tree(tree, boxes), 3u);
  EXPECT_EQ(inner_area(tree), 32.0 + 5.0 + 5.0); // the root and both pairs
}

TEST(Reinsertion, LooksNoFartherThanItMay) {
  const std::vector<TreeBox> boxes = boxes_of_many_sizes();
  const BoxTree before = build_box_tree(boxes);
  std::vector<double> areas{inner_area(before)};
  for (const ReinsertionConfig& config :
       {ReinsertionConfig{1, 100, 256}, ReinsertionConfig{1, 10'000, 256}, ReinsertionConfig{4, 10'000, 256}}) {
    BoxTree tree = before;
    reinsert_subtrees(tree, config);
    areas.push_back(inner_area(tree));
    EXPECT_LT(areas.back(), areas[areas.size() - 2]);
  }
  for (const ReinsertionConfig& config :
       {ReinsertionConfig{0, 100, 256}, ReinsertionConfig{4, 0, 256}, ReinsertionConfig{4, 100, 0}}) {
    BoxTree tree = before;
    reinsert_subtrees(tree, config);
    EXPECT_TRUE(test::same(tree, before));
  }
}

/// Nested boxes, each larger by a factor than the one before: the best tree is a chain.
std::vector<TreeBox> nested_boxes(int count, double factor) {
  std::vector<TreeBox> boxes;
  for (int i = 0; i < count; ++i) {
    const auto size = static_cast<float>(std::pow(factor, i));
    boxes.push_back({{-size, -size, -size}, {size, size, size}});
  }
  return boxes;
}

TEST(Reinsertion, MakesAChainOfNestedBoxes) {
  const std::vector<TreeBox> boxes = nested_boxes(3000, 1.01);
  const BoxTree before = build_box_tree(boxes);
  BoxTree tree = before;
  reinsert_subtrees(tree);
  EXPECT_GT(check_tree(tree, boxes), kDefaultTreeDepth);
  EXPECT_LT(inner_area(tree), inner_area(before));
}

TEST(Reinsertion, WideTreesThatWouldBeTooDeepStayAsTheSplitsMadeThem) {
  const auto nodes_after = [](std::span<const TreeBox> boxes, uint32_t passes) {
    const WideTree tree = build_wide_tree(boxes, 40, {.passes = passes});
    EXPECT_LE(tree.depth, 40u);
    return tree.binary;
  };
  const std::vector<TreeBox> many = nested_boxes(3000, 1.01);
  EXPECT_TRUE(test::same(nodes_after(many, 4), nodes_after(many, 0)));
  // 150 boxes stay within the limit, although the binary tree has more than 40 levels.
  const std::vector<TreeBox> few = nested_boxes(150, 1.2);
  const BoxTree moved = nodes_after(few, 4);
  EXPECT_GT(check_tree(moved, few), 40u);
  EXPECT_LT(inner_area(moved), inner_area(nodes_after(few, 0)));
}

TEST(Reinsertion, EndsOnEqualAndExtremeBoxes) {
  constexpr float kMax = std::numeric_limits<float>::max();
  const std::vector<TreeBox> points(5000, TreeBox{{1, 2, 3}, {1, 2, 3}});
  const std::vector<TreeBox> huge(5000, TreeBox{{-kMax, -kMax, -kMax}, {kMax, kMax, kMax}});
  std::vector<TreeBox> mixed = huge;
  mixed.insert(mixed.end(), points.begin(), points.end());
  for (const std::vector<TreeBox>& boxes :
       {std::vector<TreeBox>{}, std::vector(1, points[0]), std::vector(2, points[0]), std::vector(3, points[0]), points,
        huge, mixed}) {
    BoxTree tree = build_box_tree(boxes);
    reinsert_subtrees(tree);
    if (!boxes.empty()) check_tree(tree, boxes);
  }
}

} // namespace
} // namespace packtrace
