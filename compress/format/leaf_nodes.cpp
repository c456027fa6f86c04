#include "compress/format/leaf_nodes.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "compress/format/index_codec.h"

namespace packtrace {
namespace {

constexpr uint32_t kWidth = baked::kNodeWidth;
constexpr float kTypical = 64.0f; // triangles of a node

/// Four lanes, so that one instruction extends a side: low ends negated, so that all of it are maxima.
struct alignas(16) FloatBox {
  std::array<float, 4> minus_lo, hi;

  void extend(const FloatBox& other) {
    for (size_t i = 0; i < 4; ++i) {
      minus_lo[i] = other.minus_lo[i] > minus_lo[i] ? other.minus_lo[i] : minus_lo[i];
      hi[i] = other.hi[i] > hi[i] ? other.hi[i] : hi[i];
    }
  }
  float half_area() const {
    const float x = hi[0] + minus_lo[0], y = hi[1] + minus_lo[1], z = hi[2] + minus_lo[2];
    return x * y + y * z + z * x;
  }
};

/// A run of triangles.
struct RunNode {
  float area = 0.0f;
  uint8_t first = 0, count = 0, right = 0; ///< the left child is the next node
  bool is_node = false;                    ///< rather than nodes on both sides
  float node_cost = 0.0f;                  ///< as one node or several
  std::array<float, kWidth> leaf_cost{};   ///< as i leaves at most, in [i - 1]
  std::array<uint8_t, kWidth> on_left{};   ///< leaves of the left child; 0: the run is one leaf
};

class RunTree {
public:
  RunTree(std::span<const TreeGridBox> boxes, const TreeCosts& costs) : costs_(costs) {
    for (size_t i = 0; i < boxes.size(); ++i)
      for (size_t axis = 0; axis < 3; ++axis) {
        boxes_[i].minus_lo[axis] = -static_cast<float>(boxes[i].lo[axis]);
        boxes_[i].hi[axis] = static_cast<float>(boxes[i].hi[axis]);
      }
    build(0, static_cast<uint32_t>(boxes.size()));
    extra_ = static_cast<float>(costs.extra_node) * nodes_[0].area * kTypical / static_cast<float>(boxes.size());
    while (size_-- > 0) choose(nodes_[size_]);
  }

  void emit(std::vector<LeafNode>& out, uint32_t number = 0) const {
    const RunNode& node = nodes_[number];
    if (node.is_node) {
      out.push_back({node.first, 0, {}});
      emit_leaves(number, kWidth, out.back());
    } else {
      emit(out, number + 1);
      emit(out, node.right);
    }
  }

private:
  void build(uint32_t first, uint32_t count) {
    const uint32_t number = size_++;
    std::array<float, kMaxClusterTriangles> right_area;
    FloatBox box = boxes_[first + count - 1];
    for (uint32_t i = count - 1; i > 0; --i) {
      right_area[i] = box.half_area();
      box.extend(boxes_[first + i - 1]);
    }
    nodes_[number].area = box.half_area();
    nodes_[number].first = static_cast<uint8_t>(first), nodes_[number].count = static_cast<uint8_t>(count);
    if (count == 1) return;
    uint32_t left = 1;
    float least = std::numeric_limits<float>::infinity();
    box = boxes_[first];
    for (uint32_t i = 1; i < count; ++i) {
      const float cost = box.half_area() * static_cast<float>(i) + right_area[i] * static_cast<float>(count - i);
      const auto off_middle = [count](uint32_t split) {
        return std::max(2 * split, count) - std::min(2 * split, count);
      };
      if (cost < least || (cost == least && off_middle(i) < off_middle(left))) least = cost, left = i;
      box.extend(boxes_[first + i]);
    }
    build(first, left);
    nodes_[number].right = static_cast<uint8_t>(size_);
    build(first + left, count - left);
  }

  /// The children of `node` have been chosen.
  void choose(RunNode& node) {
    const bool may_be_leaf = node.count <= costs_.max_leaf_triangles;
    const auto batches = static_cast<float>((node.count + kWidth - 1) / kWidth);
    const float as_leaf = may_be_leaf ? node.area * (leaf_ + batch_ * batches) : std::numeric_limits<float>::infinity();
    node.leaf_cost.fill(as_leaf);
    const RunNode *left = nullptr, *right = nullptr;
    if (node.count > 1) {
      left = &node + 1, right = &nodes_[node.right];
      for (uint32_t i = 2; i <= kWidth; ++i)
        for (uint32_t k = 1; k < i; ++k)
          if (const float cost = left->leaf_cost[k - 1] + right->leaf_cost[i - k - 1]; cost < node.leaf_cost[i - 1])
            node.leaf_cost[i - 1] = cost, node.on_left[i - 1] = static_cast<uint8_t>(k);
    }
    const float as_node = node.area * node_ + node.leaf_cost[kWidth - 1];
    const float as_nodes = node.count > 1 ? left->node_cost + right->node_cost + extra_ : as_node;
    node.is_node = node.count == 1 || as_node <= as_nodes;
    node.node_cost = node.is_node ? as_node : as_nodes;
  }

  void emit_leaves(uint32_t number, uint32_t slots, LeafNode& out) const {
    const RunNode& node = nodes_[number];
    const uint32_t on_left = node.on_left[slots - 1];
    if (on_left == 0) {
      out.triangles[out.leaf_count++] = node.count;
    } else {
      emit_leaves(number + 1, on_left, out);
      emit_leaves(node.right, slots - on_left, out);
    }
  }

  const TreeCosts& costs_;
  const float node_ = static_cast<float>(costs_.node), leaf_ = static_cast<float>(costs_.leaf),
              batch_ = static_cast<float>(costs_.batch);
  float extra_ = 0.0f; ///< of one more node
  std::array<FloatBox, kMaxClusterTriangles> boxes_{};
  std::array<RunNode, 2 * kMaxClusterTriangles> nodes_;
  uint32_t size_ = 0;
};

} // namespace

void find_leaf_nodes(std::span<const TreeGridBox> boxes, const TreeCosts& costs, std::vector<LeafNode>& nodes) {
  assert(!boxes.empty() && boxes.size() <= kMaxClusterTriangles);
  RunTree(boxes, costs).emit(nodes);
}

} // namespace packtrace
