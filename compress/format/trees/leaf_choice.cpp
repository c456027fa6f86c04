#include "compress/format/trees/leaf_choice.h"

#include <algorithm>
#include <limits>

namespace packtrace {
namespace {

constexpr uint32_t kWidth = baked::kNodeWidth;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

class Chooser {
public:
  Chooser(std::span<RunNode> nodes, const TreeCosts& costs, double typical_area)
      : nodes_(nodes), costs_(costs), extra_(static_cast<float>(costs.extra_node * typical_area)) {
    for (size_t i = nodes.size(); i-- > 0;) choose(nodes[i]);
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
  /// The children of `node` must have been processed.
  void choose(RunNode& node) const {
    const bool may_be_leaf = node.count <= costs_.max_leaf_triangles;
    const uint32_t whole_batches = (node.count + kWidth - 1) / kWidth;
    const auto batches = static_cast<float>(whole_batches);
    std::fill_n(node.leaf_cost, kWidth, may_be_leaf ? node.area * (leaf_ + batch_ * batches) : kInfinity);
    float as_nodes = kInfinity;
    if (node.right != 0) {
      const RunNode &left = (&node)[1], &right = nodes_[node.right];
      join(left, right, node);
      as_nodes = left.node_cost + right.node_cost + extra_;
    }
    const float as_node = node.area * node_ + node.leaf_cost[kWidth - 1];
    node.is_node = node.right == 0 || as_node <= as_nodes;
    node.node_cost = node.is_node ? as_node : as_nodes;
  }

  /// Computes leaf_cost for all i at once: the least cost over k leaves on the left and i - k on the right.
  static void join(const RunNode& left, const RunNode& right, RunNode& out) {
    static_assert(kWidth == 8);
    const Float4 none = Float4{} + kInfinity;
    Float4 low = load_lanes(out.leaf_cost), high = load_lanes(out.leaf_cost + 4);
    // Lane i - 1: cost of the right side as at most i - k leaves. Registers are shifted, because a load that overlaps
    // two recent stores waits until both have reached the cache.
    Float4 right_low = load_lanes(right.leaf_cost), right_high = load_lanes(right.leaf_cost + 4);
    for (uint32_t k = 1; k < kWidth; ++k) {
      right_high = __builtin_shufflevector(right_low, right_high, 3, 4, 5, 6);
      right_low = __builtin_shufflevector(none, right_low, 0, 4, 5, 6);
      const float on_left = left.leaf_cost[k - 1];
      low = min_of(low, on_left + right_low);
      high = min_of(high, on_left + right_high);
    }
    std::memcpy(out.leaf_cost, &low, sizeof low);
    std::memcpy(out.leaf_cost + 4, &high, sizeof high);
  }

  static Float4 min_of(Float4 a, Float4 b) { return a < b ? a : b; }

  /// Number of leaves on the left in the cheapest division of both sides into `slots` leaves; 0 if one leaf costs the
  /// same.
  uint32_t leaves_on_left(const RunNode& node, uint32_t slots) const {
    if (node.right == 0 || node.leaf_cost[slots - 1] == node.leaf_cost[0]) return 0;
    const RunNode &left = (&node)[1], &right = nodes_[node.right];
    uint32_t k = 1;
    while (left.leaf_cost[k - 1] + right.leaf_cost[slots - k - 1] != node.leaf_cost[slots - 1]) ++k;
    return k;
  }

  void emit_leaves(uint32_t number, uint32_t slots, LeafNode& out) const {
    const RunNode& node = nodes_[number];
    if (const uint32_t on_left = leaves_on_left(node, slots); on_left > 0) {
      emit_leaves(number + 1, on_left, out);
      emit_leaves(node.right, slots - on_left, out);
    } else {
      out.triangles[out.leaf_count++] = node.count;
    }
  }

  std::span<RunNode> nodes_;
  const TreeCosts& costs_;
  const float extra_; ///< cost of one more node
  const float node_ = static_cast<float>(costs_.node), leaf_ = static_cast<float>(costs_.leaf),
              batch_ = static_cast<float>(costs_.batch);
};

} // namespace

void choose_leaf_nodes(std::span<RunNode> nodes, const TreeCosts& costs, double typical_area,
                       std::vector<LeafNode>& out) {
  Chooser(nodes, costs, typical_area).emit(out);
}

} // namespace packtrace
