#include "runtime/voxels/thing_tree.h"

#include <cstddef>
#include <numeric>

namespace packtrace {
namespace {

Bounds box_of(const std::vector<Bounds>& boxes, const std::vector<uint32_t>& order, size_t begin, size_t end) {
  Bounds box;
  for (size_t i = begin; i < end; ++i) box.extend(boxes[order[i]]);
  return box;
}

/// Partitions things at the median along the longest extent of their centres; returns its place. Equal halves keep the
/// tree as shallow as the number of things allows.
size_t split(const std::vector<Bounds>& boxes, std::vector<uint32_t>& order, size_t begin, size_t end) {
  Bounds centers;
  for (size_t i = begin; i < end; ++i) centers.extend(boxes[order[i]].centre());
  const DVec3 extent = centers.hi - centers.lo;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  const size_t middle = (begin + end) / 2;
  const auto at = [&](size_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](uint32_t a, uint32_t b) {
    const double ca = boxes[a].lo[axis] + boxes[a].hi[axis], cb = boxes[b].lo[axis] + boxes[b].hi[axis];
    return ca < cb || (ca == cb && a < b);
  });
  return middle;
}

} // namespace

ThingTree::ThingTree(const std::vector<Bounds>& boxes) {
  std::vector<uint32_t> order(boxes.size());
  std::iota(order.begin(), order.end(), 0u);
  if (order.empty()) return;
  const Bounds all = box_of(boxes, order, 0, order.size());
  centre_ = all.centre();
  const DVec3 extent = all.extent();
  scale_ = 2.0 / std::max({extent.x, extent.y, extent.z});
  if (!std::isfinite(scale_)) scale_ = 1.0; // all boxes are one point
  build(boxes, order, 0, order.size());
}

int32_t ThingTree::build(const std::vector<Bounds>& boxes, std::vector<uint32_t>& order, size_t begin, size_t end) {
  const auto number = static_cast<int32_t>(nodes_.size());
  nodes_.emplace_back();
  const size_t middle = end - begin < 2 ? end : split(boxes, order, begin, end);
  const std::array<size_t, 2> half_begin{begin, middle}, half_end{middle, end};
  std::array<size_t, kWidth + 1> bound{};
  int children = 0;
  for (size_t h = 0; h < 2; ++h) {
    if (half_begin[h] == half_end[h]) continue;
    bound[static_cast<size_t>(children++)] = half_begin[h];
    if (half_end[h] - half_begin[h] > 1)
      bound[static_cast<size_t>(children++)] = split(boxes, order, half_begin[h], half_end[h]);
  }
  bound[static_cast<size_t>(children)] = end;
  Node node{};
  for (int i = 0; i < kWidth; ++i)
    for (size_t a = 0; a < kAxes; ++a) node.low[a][i] = kMissed, node.high[a][i] = -kMissed;
  for (int i = 0; i < children; ++i) {
    const size_t first = bound[static_cast<size_t>(i)], last = bound[static_cast<size_t>(i) + 1];
    const Bounds box = box_of(boxes, order, first, last);
    const DVec3 low = (box.lo - centre_) * scale_, high = (box.hi - centre_) * scale_;
    for (size_t a = 0; a < kAxes; ++a) {
      node.low[a][i] = static_cast<float>(low[static_cast<int>(a)]);
      node.high[a][i] = static_cast<float>(high[static_cast<int>(a)]);
    }
    node.child[static_cast<size_t>(i)] =
        last - first == 1 ? ~static_cast<int32_t>(order[first]) : build(boxes, order, first, last);
  }
  nodes_[static_cast<size_t>(number)] = node;
  return number;
}

} // namespace packtrace
