#include "compress/format/trees/node_tree.h"

#include "compress/format/trees/node_writer.h"
#include "compress/format/trees/wide_tree.h"
#include "pbrt_import/base/error.h"

namespace packtrace {

NodeTree build_node_tree(const LeafNodes& leaves, const ReinsertionConfig& moves) {
  if (leaves.nodes.size() > uint64_t{1} << 30)
    throw Error(ErrorKind::kLimitExceeded, "a tree has more than 2^30 nodes with leaves");
  std::vector<TreeBox> boxes;
  boxes.reserve(leaves.boxes.size());
  for (const TreeGridBox& box : leaves.boxes) {
    TreeBox& out = boxes.emplace_back();
    for (size_t axis = 0; axis < 3; ++axis)
      out.lo[axis] = static_cast<float>(box.lo[axis]), out.hi[axis] = static_cast<float>(box.hi[axis]);
  }
  const WideTree built = build_wide_tree(boxes, baked::kMaxTreeDepth, moves);
  const std::vector<WideNode>& wide = built.nodes;
  NodeTree tree;
  tree.nodes.resize(wide.size()), tree.boxes.resize(wide.size());
  for (size_t i = wide.size(); i-- > 0;) {
    if (wide[i].child_count == 0) {
      const uint32_t leaf = built.binary.order[built.binary.nodes[wide[i].source].first];
      tree.nodes[i] = leaves.nodes[leaf], tree.boxes[i] = leaves.boxes[leaf];
    } else {
      tree.boxes[i] = write_inner_node(wide[i].first_child, wide[i].child_count, tree.nodes, tree.boxes, tree.nodes[i]);
    }
  }
  tree.depth = built.depth;
  return tree;
}

} // namespace packtrace
