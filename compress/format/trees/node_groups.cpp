#include "compress/format/trees/node_groups.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "compress/format/trees/leaf_choice.h"

namespace packtrace {
namespace {

constexpr double kExtraGroup = 0.5;      ///< value of TreeCosts::extra_node: strips also end where groups do
constexpr uint32_t kUndivided = 2;       ///< splits of so few triangles do not improve the trees
constexpr uint32_t kCoordinateBits = 24; ///< integers below 2^24 are exact in floats

/// Boxes of triangles in integer coordinates below 2^kCoordinateBits. Points that are farther apart are put on a
/// coarser lattice.
class PointBoxes {
public:
  explicit PointBoxes(std::span<const LatticePoint> points) {
    LatticePoint lo = points[0], hi = points[0];
    for (const LatticePoint& p : points)
      for (size_t axis = 0; axis < 3; ++axis)
        lo[axis] = std::min(lo[axis], p[axis]), hi[axis] = std::max(hi[axis], p[axis]);
    uint64_t extent = 0;
    for (size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, static_cast<uint64_t>(hi[axis] - lo[axis]));
    const auto bits = static_cast<uint32_t>(std::bit_width(extent));
    const uint32_t shift = bits > kCoordinateBits ? bits - kCoordinateBits : 0;
    for (size_t i = 0; i < points.size(); ++i) {
      TreeGridBox box;
      for (size_t axis = 0; axis < 3; ++axis)
        box.lo[axis] = box.hi[axis] = static_cast<int32_t>((points[i][axis] - lo[axis]) >> shift);
      boxes_[i] = sweep_box(box);
    }
  }
  sweep_kernels::Box of(const Triangle& triangle) const {
    sweep_kernels::Box box = boxes_[triangle.x];
    extend(box, boxes_[triangle.y]);
    extend(box, boxes_[triangle.z]);
    return box;
  }

private:
  std::array<sweep_kernels::Box, kMaxClusterVertices> boxes_;
};

/// A binary tree over boxes in any order. Each node of more than kUndivided boxes takes the split with the lowest
/// surface area heuristic cost, of all splits by the boxes' centres along an axis.
class SweepTree {
public:
  /// @param triangles 1..128
  SweepTree(const PointBoxes& points, std::span<const Triangle> triangles) {
    const auto count = static_cast<uint32_t>(triangles.size());
    std::array<std::array<int32_t, 4>, kMaxClusterTriangles> centres; // twice the centres
    for (uint32_t i = 0; i < count; ++i) {
      const sweep_kernels::Box& box = boxes_[i] = points.of(triangles[i]);
      const Int4 centre =
          __builtin_convertvector(load_lanes(box.hi), Int4) - __builtin_convertvector(load_lanes(box.minus_lo), Int4);
      std::memcpy(centres[i].data(), &centre, sizeof centre);
    }
    for (size_t axis = 0; axis < 3; ++axis) {
      std::array<uint32_t, kMaxClusterTriangles> along;
      for (uint32_t i = 0; i < count; ++i) along[i] = static_cast<uint32_t>(centres[i][axis]);
      sort(std::span(along).first(count), order_[axis]);
    }
    build(0, count);
  }
  std::span<RunNode> nodes() { return std::span(nodes_).first(size_); }
  /// The box numbers from left to right.
  std::span<const uint8_t> order() const { return std::span(order_[0]).first(nodes_[0].count); }

private:
  /// Sorts places along an axis by their highest bits; stable.
  static void sort(std::span<const uint32_t> places, std::array<uint8_t, kMaxClusterTriangles>& order) {
    constexpr uint32_t kBits = 8;
    uint32_t most = 0;
    for (const uint32_t place : places) most = std::max(most, place);
    const auto bits = static_cast<uint32_t>(std::bit_width(most));
    const uint32_t shift = bits > kBits ? bits - kBits : 0;
    std::array<uint8_t, (1u << kBits) + 1> begin{};
    for (const uint32_t place : places) ++begin[(place >> shift) + 1];
    for (size_t i = 1; i < begin.size(); ++i) begin[i] = static_cast<uint8_t>(begin[i] + begin[i - 1]);
    for (uint32_t i = 0; i < places.size(); ++i) order[begin[places[i] >> shift]++] = static_cast<uint8_t>(i);
  }

  void build(uint32_t first, uint32_t count) {
    const uint32_t number = size_++;
    RunNode& node = nodes_[number];
    node.first = static_cast<uint8_t>(first), node.count = static_cast<uint8_t>(count), node.right = 0;
    if (count <= kUndivided) {
      sweep_kernels::Box box = boxes_[order_[0][first]];
      for (uint32_t i = 1; i < count; ++i) extend(box, boxes_[order_[0][first + i]]);
      node.area = half_area(box);
      return;
    }
    const uint32_t left = split(first, count, node.area);
    build(first, left);
    node.right = static_cast<uint8_t>(size_);
    build(first + left, count - left);
  }

  /// Finds the best split and partitions the boxes in all three orders. Returns the number of boxes on the left.
  uint32_t split(uint32_t first, uint32_t count, float& area) {
    std::array<const uint8_t*, 3> orders;
    for (size_t axis = 0; axis < 3; ++axis) orders[axis] = order_[axis].data() + first;
    const sweep_kernels::Split best = kernels_.split_orders(boxes_.data(), orders.data(), count);
    area = best.area;
    for (uint32_t i = 0; i < count; ++i) on_left_[order_[best.axis][first + i]] = i < best.left;
    for (size_t axis = 0; axis < 3; ++axis)
      if (axis != best.axis) partition(order_[axis].data() + first, count);
    return best.left;
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

  const sweep_kernels::Kernels& kernels_ = sweep_kernels::kernels();
  std::array<sweep_kernels::Box, kMaxClusterTriangles> boxes_;
  /// Per axis: box numbers; each node's run is sorted by centres along the axis.
  std::array<std::array<uint8_t, kMaxClusterTriangles>, 3> order_;
  std::array<uint8_t, kMaxClusterTriangles> on_left_; ///< per box
  std::array<RunNode, 2 * kMaxClusterTriangles> nodes_;
  uint32_t size_ = 0;
};

} // namespace

void NodeGroups::find(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
  SweepTree tree(PointBoxes(positions), triangles);
  triangles_.clear(), ends_.clear(), nodes_.clear();
  order_.assign(tree.order().begin(), tree.order().end());
  for (const uint32_t i : order_) triangles_.push_back(triangles[i]);
  const RunNode& root = tree.nodes()[0];
  TreeCosts costs;
  costs.extra_node = kExtraGroup;
  choose_leaf_nodes(tree.nodes(), costs, typical_node_area(root.area, root.count), nodes_);
  for (const LeafNode& node : nodes_)
    if (node.first_triangle > 0) ends_.push_back(node.first_triangle);
  ends_.push_back(static_cast<uint32_t>(triangles.size()));
}

} // namespace packtrace
