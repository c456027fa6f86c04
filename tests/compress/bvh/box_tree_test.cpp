#include <cmath>
#include <deque>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/format/trees/wide_tree.h"
#include "tests/compress/bvh/box_checks.h"

namespace packtrace {
namespace {

using test::check_tree, test::contains, test::random_boxes;

TEST(BoxTree, HoldsEveryBoxOnce) {
  for (const uint32_t count : {1u, 2u, 3u, 7u, 100u, 10'000u}) {
    SCOPED_TRACE(count);
    const std::vector<TreeBox> boxes = random_boxes(count, 0.1f, count);
    EXPECT_LE(check_tree(build_box_tree(boxes), boxes), 40u);
  }
  EXPECT_TRUE(build_box_tree({}).nodes.empty());
}

TEST(BoxTree, SeparatesWhatIsApart) {
  // Two groups far apart: the first split separates them.
  std::vector<TreeBox> boxes = random_boxes(200, 0.1f, 1);
  for (size_t i = 0; i < boxes.size(); i += 2) boxes[i].lo[1] += 10.0f, boxes[i].hi[1] += 10.0f;
  const BoxTree tree = build_box_tree(boxes);
  EXPECT_EQ(tree.nodes[1].count, 100u);
  EXPECT_LT(tree.nodes[1].box.hi[1], 2.0f);
  EXPECT_GT(tree.nodes[tree.nodes[0].right].box.lo[1], 8.0f);
}

TEST(BoxTree, EndsOnEqualAndExtremeBoxes) {
  constexpr float kMax = std::numeric_limits<float>::max(), kDenormal = std::numeric_limits<float>::denorm_min();
  std::deque<std::vector<TreeBox>> cases;                  // deque: elements stay in place
  cases.emplace_back(5000, TreeBox{{1, 2, 3}, {1, 2, 3}}); // equal points
  cases.emplace_back(5000, TreeBox{{-kMax, -kMax, -kMax}, {kMax, kMax, kMax}});
  std::vector<TreeBox>& growing = cases.emplace_back(); // each split separates one box
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

TEST(BoxTree, IsTheSameForAnyThreadCount) {
  const std::vector<TreeBox> boxes = random_boxes(50'000, 0.02f, 9);
  const BoxTree tree = build_box_tree(boxes);
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_TRUE(test::same(build_box_tree(boxes), tree));
}

/// Checks the wide subtree at a node, counts its boxes in `seen`, and returns its number of levels.
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
    EXPECT_LE(wide.size() - count, 1 + count * 2 / 5); // at least 3.5 children per inner node on average
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
