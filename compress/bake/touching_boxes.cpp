#include "compress/bake/touching_boxes.h"

#include <algorithm>
#include <functional>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

namespace packtrace {
namespace {

constexpr size_t kLeafBoxes = 4;

bool overlap(const Bounds& a, const Bounds& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(a.lo[axis] <= b.hi[axis] && b.lo[axis] <= a.hi[axis])) return false;
  return true;
}

/// A binary tree over boxes, halved along the widest axis of their centres. Nodes follow their parent: the left child
/// of node n is n + 1.
class BoxTree {
public:
  explicit BoxTree(std::span<const Bounds> boxes) : boxes_(boxes) {
    for (uint32_t i = 0; i < boxes.size(); ++i)
      if (!boxes[i].empty()) order_.push_back(i);
    if (!order_.empty()) build(0, order_.size());
  }

  bool touches_another(uint32_t box) const { return !boxes_[box].empty() && find(0, box); }

private:
  struct Node {
    Bounds bounds;
    size_t begin = 0, end = 0, right = 0; ///< of order_; right == 0: a leaf
  };

  size_t build(size_t begin, size_t end) {
    const size_t number = nodes_.size();
    nodes_.push_back({{}, begin, end, 0});
    Bounds bounds, centres;
    for (size_t i = begin; i < end; ++i) bounds.extend(boxes_[order_[i]]), centres.extend(boxes_[order_[i]].centre());
    nodes_[number].bounds = bounds;
    if (end - begin <= kLeafBoxes) return number;
    const DVec3 extent = centres.extent();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const size_t middle = begin + (end - begin) / 2;
    const auto at = [&](size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](uint32_t a, uint32_t b) {
      return boxes_[a].lo[axis] + boxes_[a].hi[axis] < boxes_[b].lo[axis] + boxes_[b].hi[axis];
    });
    build(begin, middle);
    const size_t right = build(middle, end);
    nodes_[number].right = right;
    return number;
  }

  bool find(size_t number, uint32_t box) const {
    const Node& node = nodes_[number];
    if (!overlap(node.bounds, boxes_[box])) return false;
    if (node.right != 0) return find(number + 1, box) || find(node.right, box);
    for (size_t i = node.begin; i < node.end; ++i)
      if (order_[i] != box && overlap(boxes_[order_[i]], boxes_[box])) return true;
    return false;
  }

  std::span<const Bounds> boxes_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

} // namespace

uint64_t count_touching(std::span<const Bounds> boxes, std::span<const uint8_t> wanted) {
  const BoxTree tree(boxes);
  return tbb::parallel_reduce(
      tbb::blocked_range<size_t>(0, boxes.size(), 256), uint64_t{0},
      [&](const tbb::blocked_range<size_t>& range, uint64_t count) {
        for (size_t i = range.begin(); i < range.end(); ++i)
          count += wanted[i] != 0 && tree.touches_another(static_cast<uint32_t>(i));
        return count;
      },
      std::plus<>());
}

} // namespace packtrace
