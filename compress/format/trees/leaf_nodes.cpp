#include "compress/format/trees/leaf_nodes.h"

#include <cassert>
#include <limits>

#include "compress/format/cluster/index_codec.h"
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
    std::array<Float4, kMaxClusterTriangles> right_area;
    FloatBox box = boxes_[first + count - 1];
    for (uint32_t i = count - 1; i > 0; --i) {
      right_area[i] = half_area(box);
      box.extend(boxes_[first + i - 1]);
    }
    nodes_[number].area = first_lane(half_area(box));
    nodes_[number].first = static_cast<uint8_t>(first), nodes_[number].count = static_cast<uint8_t>(count);
    if (count == 1) return;
    RunSplit best{std::numeric_limits<float>::infinity(), 1};
    box = boxes_[first];
    for (uint32_t i = 1; i < count; ++i) {
      const Float4 left_cost = half_area(box) * static_cast<float>(i);
      if (first_lane(left_cost) > best.cost) break; // the cost of the left side only grows
      best.improve(first_lane(left_cost + right_area[i] * static_cast<float>(count - i)), i, count);
      box.extend(boxes_[first + i]);
    }
    build(first, best.left);
    nodes_[number].right = static_cast<uint8_t>(size_);
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
