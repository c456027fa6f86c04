#include "compress/format/trees/leaf_nodes.h"

#include <cassert>

#include "compress/format/trees/leaf_choice.h"

namespace packtrace {
namespace {

static_assert(kMaxClusterTriangles <= sweep_kernels::kMaxBoxes);

/// Binary tree over runs of triangles in stream order, split by the surface area heuristic.
class RunTree {
public:
  explicit RunTree(std::span<const TreeGridBox> boxes) {
    for (size_t i = 0; i < boxes.size(); ++i) boxes_[i] = sweep_box(boxes[i]);
    build(0, static_cast<uint32_t>(boxes.size()));
  }
  std::span<RunNode> nodes() { return std::span(nodes_).first(size_); }

private:
  void build(uint32_t first, uint32_t count) {
    const uint32_t number = size_++;
    RunNode& node = nodes_[number];
    node.first = static_cast<uint8_t>(first), node.count = static_cast<uint8_t>(count), node.right = 0;
    uint32_t left = 1; // two boxes have one split
    if (count <= 2) {
      sweep_kernels::Box box = boxes_[first];
      extend(box, boxes_[first + count - 1]);
      node.area = half_area(box);
      if (count == 1) return;
    } else {
      const sweep_kernels::Split best = kernels_.split_run(boxes_.data() + first, count);
      node.area = best.area, left = best.left;
    }
    build(first, left);
    node.right = static_cast<uint8_t>(size_);
    build(first + left, count - left);
  }

  const sweep_kernels::Kernels& kernels_ = sweep_kernels::kernels();
  std::array<sweep_kernels::Box, kMaxClusterTriangles> boxes_;
  std::array<RunNode, 2 * kMaxClusterTriangles> nodes_;
  uint32_t size_ = 0;
};

} // namespace

void find_leaf_nodes(std::span<const TreeGridBox> boxes, const TreeCosts& costs, double typical_area,
                     std::vector<LeafNode>& nodes) {
  assert(!boxes.empty() && boxes.size() <= kMaxClusterTriangles);
  RunTree tree(boxes);
  choose_leaf_nodes(tree.nodes(), costs, typical_area, nodes);
}

} // namespace packtrace
