#include "compress/format/trees/leaf_nodes.h"

#include <cassert>

#include "compress/format/trees/leaf_choice.h"

namespace packtrace {
namespace {

/// Binary tree over runs of triangles in stream order, split by the surface area heuristic.
class RunTree {
public:
  explicit RunTree(std::span<const TreeGridBox> boxes) {
    for (size_t i = 0; i < boxes.size(); ++i) boxes_[i] = FloatBox::of(boxes[i]);
    build(0, static_cast<uint32_t>(boxes.size()));
  }
  std::span<RunNode> nodes() { return std::span(nodes_).first(size_); }

private:
  void build(uint32_t first, uint32_t count) {
    const uint32_t number = size_++;
    RunNode& node = nodes_[number];
    node.first = static_cast<uint8_t>(first), node.count = static_cast<uint8_t>(count), node.right = 0;
    RunSplit best; // two boxes have one split
    if (count <= 2) {
      FloatBox box = boxes_[first];
      box.extend(boxes_[first + count - 1]);
      node.area = first_lane(half_area(box));
      if (count == 1) return;
    } else {
      node.area = sweep_run(count, [&](uint32_t i) { return boxes_[first + i]; }, best);
    }
    build(first, best.left);
    node.right = static_cast<uint8_t>(size_);
    build(first + best.left, count - best.left);
  }

  std::array<FloatBox, kMaxClusterTriangles> boxes_;
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
