#include "compress/bake/grid/touching_boxes.h"

#include <algorithm>
#include <limits>

#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

constexpr size_t kLeafBoxes = 4;

/// A binary tree over boxes, split at the median along the widest axis of their centres. Nodes are in depth-first
/// order: the left child of node n is n + 1.
class TouchTree {
public:
  TouchTree(std::span<const Bounds> boxes, std::span<const double> sizes) : boxes_(boxes), sizes_(sizes) {
    std::vector<Item> items;
    for (uint32_t i = 0; i < boxes.size(); ++i)
      if (!boxes[i].empty()) items.push_back({boxes[i].lo + boxes[i].hi, i});
    if (items.empty()) return;
    order_.resize(items.size());
    nodes_.reserve(items.size());
    build(items, 0);
  }

  double smallest_touching(uint32_t box) const {
    double smallest = std::numeric_limits<double>::infinity();
    if (!boxes_[box].empty()) find_smallest(0, box, smallest);
    return smallest;
  }

private:
  struct Node {
    Bounds bounds;
    size_t begin = 0, end = 0, right = 0; ///< range in order_, and right child; right == 0 in leaf nodes
    double smallest = std::numeric_limits<double>::infinity(); ///< smallest size of its boxes
  };

  /// A box during the build. Centres are copied because partitioning them is faster than following indices.
  struct Item {
    DVec3 twice_centre;
    uint32_t box;
  };

  /// @param begin number of the first item in order_
  size_t build(std::span<Item> items, size_t begin) {
    const size_t number = nodes_.size();
    nodes_.push_back({{}, begin, begin + items.size()});
    if (items.size() <= kLeafBoxes) {
      for (size_t i = 0; i < items.size(); ++i) {
        const uint32_t box = order_[begin + i] = items[i].box;
        nodes_[number].bounds.extend(boxes_[box]);
        nodes_[number].smallest = std::min(nodes_[number].smallest, sizes_[box]);
      }
      return number;
    }
    Bounds centres;
    for (const Item& item : items) centres.extend(item.twice_centre);
    const DVec3 extent = centres.extent();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const size_t middle = items.size() / 2;
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
                     [axis](const Item& a, const Item& b) { return a.twice_centre[axis] < b.twice_centre[axis]; });
    const size_t left = build(items.first(middle), begin), right = build(items.subspan(middle), begin + middle);
    Node& node = nodes_[number];
    node.right = right;
    for (const size_t child : {left, right}) {
      node.bounds.extend(nodes_[child].bounds);
      node.smallest = std::min(node.smallest, nodes_[child].smallest);
    }
    return number;
  }

  void find_smallest(size_t number, uint32_t box, double& smallest) const {
    const Node& node = nodes_[number];
    if (node.smallest >= smallest || !overlap(node.bounds, boxes_[box])) return;
    if (node.right != 0) {
      const bool left_first = nodes_[number + 1].smallest <= nodes_[node.right].smallest;
      find_smallest(left_first ? number + 1 : node.right, box, smallest);
      find_smallest(left_first ? node.right : number + 1, box, smallest);
      return;
    }
    for (size_t i = node.begin; i < node.end; ++i)
      if (order_[i] != box && sizes_[order_[i]] < smallest && overlap(boxes_[order_[i]], boxes_[box]))
        smallest = sizes_[order_[i]];
  }

  std::span<const Bounds> boxes_;
  std::span<const double> sizes_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

} // namespace

std::vector<double> smallest_touching(std::span<const Bounds> boxes, std::span<const double> sizes,
                                      std::span<const uint32_t> asked) {
  const TouchTree tree(boxes, sizes);
  std::vector<double> result(asked.size());
  tbb::parallel_for(size_t{0}, asked.size(), [&](size_t i) { result[i] = tree.smallest_touching(asked[i]); });
  return result;
}

} // namespace packtrace
