#include "runtime/trace/packed/scene/top_tree.h"

#include <algorithm>
#include <bit>

#include "compress/format/trees/wide_tree.h"

namespace packtrace {
namespace {

void set_child(packed::TopNode& node, uint32_t slot, const TreeBox& box, uint32_t child) {
  for (size_t axis = 0; axis < 3; ++axis) node.lo[axis][slot] = box.lo[axis], node.hi[axis][slot] = box.hi[axis];
  node.child[slot] = child;
  node.slots |= 1u << slot;
}

} // namespace

std::vector<packed::TopNode> build_top_tree(std::span<const TreeBox> boxes) {
  const BoxTree binary = build_box_tree(boxes, packed::kMaxTopDepth - 1);
  const std::vector<WideNode> wide = collapse_box_tree(binary);
  const auto box_number = [&](const WideNode& node) { return binary.order[binary.nodes[node.source].first]; };
  std::vector<packed::TopNode> nodes;
  std::vector<uint32_t> place(wide.size());
  for (size_t i = 0; i < wide.size(); ++i)
    if (wide[i].child_count > 0) place[i] = static_cast<uint32_t>(nodes.size()), nodes.emplace_back();
  if (nodes.empty()) return {top_node(boxes)}; // a single box
  for (size_t i = 0; i < wide.size(); ++i) {
    for (uint32_t slot = 0; slot < wide[i].child_count; ++slot) {
      const WideNode& child = wide[wide[i].first_child + slot];
      const bool leaf = child.child_count == 0;
      set_child(nodes[place[i]], slot, binary.nodes[child.source].box,
                leaf ? packed::kTopLeaf + box_number(child) : place[wide[i].first_child + slot]);
    }
  }
  return nodes;
}

packed::TopNode top_node(std::span<const TreeBox> boxes) {
  packed::TopNode node{};
  for (uint32_t slot = 0; slot < boxes.size(); ++slot) set_child(node, slot, boxes[slot], packed::kTopLeaf + slot);
  return node;
}

uint32_t top_tree_depth(std::span<const packed::TopNode> nodes) {
  // Levels from the root to each node; a child's number is greater than its parent's.
  std::vector<uint8_t> levels(nodes.size(), 1);
  for (size_t i = 0; i < nodes.size(); ++i)
    for (uint32_t slots = nodes[i].slots; slots != 0; slots &= slots - 1)
      if (const uint32_t child = nodes[i].child[std::countr_zero(slots)]; (child & packed::kTopLeaf) == 0)
        levels[child] = static_cast<uint8_t>(levels[i] + 1);
  return *std::ranges::max_element(levels);
}

} // namespace packtrace
