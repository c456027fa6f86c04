#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/trees/box_tree.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {

inline bool contains(const TreeBox& outer, const TreeBox& inner) {
  for (size_t axis = 0; axis < 3; ++axis)
    if (!(outer.lo[axis] <= inner.lo[axis] && outer.hi[axis] >= inner.hi[axis])) return false;
  return true;
}

inline std::vector<TreeBox> random_boxes(uint32_t count, float size, uint32_t seed) {
  Random random(seed);
  std::vector<TreeBox> boxes(count);
  for (TreeBox& box : boxes)
    for (size_t axis = 0; axis < 3; ++axis) {
      box.lo[axis] = random.uniform(-1.0f, 1.0f);
      box.hi[axis] = box.lo[axis] + random.uniform(0.0f, size);
    }
  return boxes;
}

/// Checks that a subtree covers exactly order[first .. first + count). Returns its number of levels.
inline uint32_t check_subtree(const BoxTree& tree, std::span<const TreeBox> boxes, uint32_t number) {
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

inline uint32_t check_tree(const BoxTree& tree, std::span<const TreeBox> boxes) {
  EXPECT_EQ(tree.nodes.size(), 2 * boxes.size() - 1);
  EXPECT_EQ(tree.nodes[0].count, boxes.size());
  std::vector<uint32_t> seen(boxes.size());
  for (const uint32_t i : tree.order) ++seen[i];
  EXPECT_EQ(seen, std::vector<uint32_t>(boxes.size(), 1));
  return check_subtree(tree, boxes, 0);
}

inline bool same(const BoxTree& a, const BoxTree& b) {
  if (a.order != b.order || a.nodes.size() != b.nodes.size()) return false;
  for (size_t i = 0; i < a.nodes.size(); ++i)
    if (a.nodes[i].box.lo != b.nodes[i].box.lo || a.nodes[i].box.hi != b.nodes[i].box.hi ||
        a.nodes[i].right != b.nodes[i].right)
      return false;
  return true;
}

} // namespace packtrace::test
