#include "compress/bake/node_groups.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "compress/format/index_codec.h"
#include "compress/format/leaf_choice.h"

namespace packtrace {
namespace {

constexpr uint32_t kCoordinateBits = 24; ///< whole numbers below 2^24, which floats hold

/// A tree over boxes in any order: each run is split where the surface area heuristic says, of all splits along an
/// axis by the boxes' centres.
class SweepTree {
public:
  /// @param boxes 1..128, coordinates 0 .. 2^24 - 1
  explicit SweepTree(std::span<const TreeGridBox> boxes) {
    const auto count = static_cast<uint32_t>(boxes.size());
    std::array<uint32_t, kMaxClusterTriangles> keys;
    static_assert(kCoordinateBits + 1 + std::bit_width(kMaxClusterTriangles - 1) <= 32);
    for (uint32_t i = 0; i < count; ++i) boxes_[i] = FloatBox::of(boxes[i]);
    for (size_t axis = 0; axis < 3; ++axis) {
      for (uint32_t i = 0; i < count; ++i)
        keys[i] = static_cast<uint32_t>(boxes[i].lo[axis] + boxes[i].hi[axis]) * kMaxClusterTriangles + i;
      std::sort(keys.begin(), keys.begin() + count);
      for (uint32_t i = 0; i < count; ++i) order_[axis][i] = static_cast<uint8_t>(keys[i] % kMaxClusterTriangles);
    }
    build(0, count);
  }
  std::span<RunNode> nodes() { return std::span(nodes_).first(size_); }
  /// The boxes from left to right.
  std::span<const uint8_t> order() const { return std::span(order_[0]).first(nodes_[0].count); }

private:
  void build(uint32_t first, uint32_t count) {
    const uint32_t number = size_++;
    RunNode& node = nodes_[number];
    node.first = static_cast<uint8_t>(first), node.count = static_cast<uint8_t>(count);
    FloatBox box = boxes_[order_[0][first]];
    for (uint32_t i = 1; i < count; ++i) box.extend(boxes_[order_[0][first + i]]);
    node.area = first_lane(half_area(box));
    if (count == 1) return;
    uint32_t left = 1; // of two, which of them is of no account
    if (count > 2) left = split(first, count);
    build(first, left);
    node.right = static_cast<uint8_t>(size_);
    build(first + left, count - left);
  }

  /// Sorts the boxes to the left and right, in each order; how many are on the left.
  uint32_t split(uint32_t first, uint32_t count) {
    RunSplit best{std::numeric_limits<float>::infinity(), 1};
    size_t best_axis = 0;
    for (size_t axis = 0; axis < 3; ++axis)
      if (sweep(order_[axis].data() + first, count, best)) best_axis = axis;
    for (uint32_t i = 0; i < count; ++i) on_left_[order_[best_axis][first + i]] = i < best.left;
    for (size_t axis = 0; axis < 3; ++axis)
      if (axis != best_axis) partition(order_[axis].data() + first, count);
    return best.left;
  }

  /// Improves `best` by splits of one order; whether it did.
  bool sweep(const uint8_t* order, uint32_t count, RunSplit& best) const {
    std::array<Float4, kMaxClusterTriangles> right_area;
    FloatBox box = boxes_[order[count - 1]];
    for (uint32_t i = count - 1; i > 0; --i) {
      right_area[i] = half_area(box);
      box.extend(boxes_[order[i - 1]]);
    }
    const RunSplit before = best;
    box = boxes_[order[0]];
    for (uint32_t i = 1; i < count; ++i) {
      const Float4 left_cost = half_area(box) * static_cast<float>(i);
      if (first_lane(left_cost) > best.cost) break; // it only grows
      best.improve(first_lane(left_cost + right_area[i] * static_cast<float>(count - i)), i, count);
      box.extend(boxes_[order[i]]);
    }
    return best.cost != before.cost || best.left != before.left;
  }

  void partition(uint8_t* order, uint32_t count) const {
    std::array<uint8_t, kMaxClusterTriangles> right;
    uint32_t on_left = 0, on_right = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const uint8_t box = order[i];
      order[on_left] = box, right[on_right] = box;
      on_left += on_left_[box], on_right += 1u - on_left_[box];
    }
    std::copy_n(right.begin(), on_right, order + on_left);
  }

  std::array<FloatBox, kMaxClusterTriangles> boxes_;
  std::array<std::array<uint8_t, kMaxClusterTriangles>, 3> order_; ///< runs of nodes, each by centres along an axis
  std::array<uint8_t, kMaxClusterTriangles> on_left_;              ///< by box
  std::array<RunNode, 2 * kMaxClusterTriangles> nodes_;
  uint32_t size_ = 0;
};

} // namespace

void NodeGroups::find(const QuantizedGeometry& geometry, std::span<const Triangle> triangles) {
  LatticePoint lo, hi;
  lo.fill(std::numeric_limits<int64_t>::max()), hi.fill(std::numeric_limits<int64_t>::min());
  const auto position = [&](uint32_t vertex) -> const LatticePoint& {
    return geometry.positions[geometry.vertices[vertex].position];
  };
  for (const Triangle& t : triangles)
    for (int corner = 0; corner < 3; ++corner)
      for (size_t axis = 0; axis < 3; ++axis) {
        lo[axis] = std::min(lo[axis], position(t[corner])[axis]);
        hi[axis] = std::max(hi[axis], position(t[corner])[axis]);
      }
  uint64_t extent = 0;
  for (size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, static_cast<uint64_t>(hi[axis] - lo[axis]));
  const uint32_t bits = static_cast<uint32_t>(std::bit_width(extent));
  const uint32_t shift = bits > kCoordinateBits ? bits - kCoordinateBits : 0; // coarser where the cluster is larger

  boxes_.clear();
  for (const Triangle& t : triangles) {
    TreeGridBox& box = boxes_.emplace_back();
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax({position(t.x)[axis], position(t.y)[axis], position(t.z)[axis]});
      box.lo[axis] = static_cast<int32_t>((least - lo[axis]) >> shift);
      box.hi[axis] = static_cast<int32_t>((most - lo[axis]) >> shift);
    }
  }

  SweepTree tree(boxes_);
  triangles_.clear(), ends_.clear(), nodes_.clear();
  for (const uint32_t i : tree.order()) triangles_.push_back(triangles[i]);
  choose_leaf_nodes(tree.nodes(), {}, nodes_);
  for (const LeafNode& node : nodes_)
    if (node.first_triangle > 0) ends_.push_back(node.first_triangle);
  ends_.push_back(static_cast<uint32_t>(triangles.size()));
}

} // namespace packtrace
