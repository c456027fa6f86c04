#include "runtime/trace/packed/top_tree.h"

#include "compress/bvh/wide_tree.h"

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
  if (nodes.empty()) { // one box
    nodes.emplace_back();
    set_child(nodes[0], 0, boxes[0], packed::kTopLeaf);
    return nodes;
  }
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

} // namespace packtrace
