#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A binary tree over the boxes of things, split in the middle of their longest extent.
class ThingTree {
public:
  ThingTree() = default;
  explicit ThingTree(std::vector<Bounds> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    for (size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<uint32_t>(i);
    if (!order_.empty()) build(0, order_.size());
  }

  /// Visits things whose boxes a ray meets before t_max, in no order: t_max = visit(thing, t_max). Ends once that is
  /// not above t_min.
  template <class Visit>
  void visit(DVec3 origin, DVec3 direction, double t_min, double t_max, const Visit& visit) const {
    if (nodes_.empty()) return;
    const DVec3 inverse = 1.0 / direction;
    std::vector<uint32_t>& open = stack();
    open.assign(1, 0);
    while (!open.empty() && t_max > t_min) {
      const Node& node = nodes_[open.back()];
      const auto number = open.back();
      open.pop_back();
      if (!meets(node.box, origin, inverse, t_min, t_max)) continue;
      if (node.count > 0) {
        for (uint32_t i = 0; i < node.count && t_max > t_min; ++i) {
          const uint32_t thing = order_[node.first + i];
          if (meets(boxes_[thing], origin, inverse, t_min, t_max)) t_max = visit(thing, t_max);
        }
        continue;
      }
      open.push_back(node.first), open.push_back(number + 1);
    }
  }

  uint64_t bytes() const {
    return boxes_.size() * sizeof(Bounds) + order_.size() * sizeof(uint32_t) + nodes_.size() * sizeof(Node);
  }

private:
  struct Node {
    Bounds box;
    uint32_t first = 0; ///< leaf: in order_; else the second child; the first one follows the node
    uint32_t count = 0; ///< 0: not a leaf
  };

  static std::vector<uint32_t>& stack() {
    thread_local std::vector<uint32_t> open;
    return open;
  }

  static bool meets(const Bounds& box, DVec3 origin, DVec3 inverse, double t_min, double t_max) {
    for (int a = 0; a < 3; ++a) {
      const double x = (box.lo[a] - origin[a]) * inverse[a], y = (box.hi[a] - origin[a]) * inverse[a];
      if (x != x || y != y) continue; // the ray lies in a face
      t_min = std::max(t_min, std::min(x, y) * (1.0 - 1e-12)), t_max = std::min(t_max, std::max(x, y) * (1.0 + 1e-12));
    }
    return t_min <= t_max;
  }

  void build(size_t begin, size_t end) {
    const size_t number = nodes_.size();
    nodes_.emplace_back();
    Bounds box, centers;
    for (size_t i = begin; i < end; ++i) {
      box.extend(boxes_[order_[i]]);
      centers.extend(0.5 * (boxes_[order_[i]].lo + boxes_[order_[i]].hi));
    }
    nodes_[number].box = box;
    if (end - begin <= 2) {
      nodes_[number].first = static_cast<uint32_t>(begin), nodes_[number].count = static_cast<uint32_t>(end - begin);
      return;
    }
    const DVec3 extent = centers.hi - centers.lo;
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const size_t middle = (begin + end) / 2;
    const auto at = [&](size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](uint32_t a, uint32_t b) {
      const double ca = boxes_[a].lo[axis] + boxes_[a].hi[axis], cb = boxes_[b].lo[axis] + boxes_[b].hi[axis];
      return ca < cb || (ca == cb && a < b);
    });
    build(begin, middle);
    nodes_[number].first = static_cast<uint32_t>(nodes_.size());
    build(middle, end);
  }

  std::vector<Bounds> boxes_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

} // namespace packtrace
