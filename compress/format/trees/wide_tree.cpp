#include "compress/format/trees/wide_tree.h"

#include <algorithm>
#include <array>

namespace packtrace {
namespace {

// Relative to the root's area. It keeps the number of nodes low for boxes without area.
constexpr float kNodeCost = 0x1p-20f;

/// Best use of i child slots of the parent by a subtree, i = 1 .. 8 at index i - 1.
struct Choice {
  std::array<float, kWideTreeWidth> cost{};      ///< least sum of the areas of inner nodes
  std::array<uint8_t, kWideTreeWidth> on_left{}; ///< slots for the left child's subtree; 0: the subtree takes one slot
};

class Collapser {
public:
  explicit Collapser(const BoxTree& tree) : tree_(tree), choices_(tree.nodes.size()) {
    const double area = tree.nodes.front().box.half_area();
    scale_ = area > 0.0 ? 1.0 / area : 0.0;
    for (size_t i = choices_.size(); i-- > 0;)
      if (tree_.nodes[i].count > 1) choose(static_cast<uint32_t>(i));
  }

  std::vector<WideNode> run() {
    std::vector<WideNode> nodes;
    nodes.reserve(tree_.order.size() + tree_.order.size() / 4);
    nodes.push_back({0, 0, 0});
    std::vector<uint32_t> waiting{0};
    std::vector<uint32_t> children;
    while (!waiting.empty()) {
      const uint32_t number = waiting.back();
      waiting.pop_back();
      const uint32_t source = nodes[number].source;
      if (tree_.nodes[source].count == 1) continue;
      children.clear();
      gather(source, kWideTreeWidth, children);
      nodes[number].first_child = static_cast<uint32_t>(nodes.size());
      nodes[number].child_count = static_cast<uint32_t>(children.size());
      for (auto i = static_cast<uint32_t>(children.size()); i-- > 0;)
        waiting.push_back(static_cast<uint32_t>(nodes.size()) + i);
      for (const uint32_t child : children) nodes.push_back({child, 0, 0});
    }
    return nodes;
  }

private:
  void choose(uint32_t node) {
    const Choice &left = choices_[node + 1], &right = choices_[tree_.nodes[node].right];
    Choice& out = choices_[node];
    for (uint32_t i = 2; i <= kWideTreeWidth; ++i) {
      float least = left.cost[0] + right.cost[i - 2];
      uint32_t on_left = 1;
      for (uint32_t k = 2; k < i; ++k)
        if (const float cost = left.cost[k - 1] + right.cost[i - k - 1]; cost < least) least = cost, on_left = k;
      out.cost[i - 1] = least, out.on_left[i - 1] = static_cast<uint8_t>(on_left);
    }
    out.cost[0] =
        static_cast<float>(tree_.nodes[node].box.half_area() * scale_) + kNodeCost + out.cost[kWideTreeWidth - 1];
    for (uint32_t i = 2; i < kWideTreeWidth; ++i)
      if (out.cost[0] < out.cost[i - 1]) out.cost[i - 1] = out.cost[0], out.on_left[i - 1] = 0;
  }

  /// Appends the nodes that represent a subtree in up to `slots` child slots.
  void gather(uint32_t node, uint32_t slots, std::vector<uint32_t>& children) const {
    const uint32_t on_left = slots == 1 ? 0 : choices_[node].on_left[slots - 1];
    if (on_left == 0) {
      children.push_back(node);
      return;
    }
    gather(node + 1, on_left, children);
    gather(tree_.nodes[node].right, slots - on_left, children);
  }

  const BoxTree& tree_;
  std::vector<Choice> choices_;
  double scale_ = 0.0;
};

uint32_t depth_of(std::span<const WideNode> nodes) {
  if (nodes.empty()) return 0;
  uint32_t depth = 0;
  std::vector<uint32_t> level(nodes.size());
  level[0] = 1;
  for (size_t i = 0; i < nodes.size(); ++i) {
    depth = std::max(depth, level[i]);
    for (uint32_t child = 0; child < nodes[i].child_count; ++child) level[nodes[i].first_child + child] = level[i] + 1;
  }
  return depth;
}

} // namespace

std::vector<WideNode> collapse_box_tree(const BoxTree& tree) {
  if (tree.nodes.empty()) return {};
  return Collapser(tree).run();
}

WideTree build_wide_tree(std::span<const TreeBox> boxes, uint32_t max_depth, const ReinsertionConfig& config) {
  WideTree tree;
  const auto build = [&](const ReinsertionConfig& moves) {
    tree.binary = build_box_tree(boxes, max_depth);
    reinsert_subtrees(tree.binary, moves);
    tree.nodes = collapse_box_tree(tree.binary);
    tree.depth = depth_of(tree.nodes);
  };
  build(config);
  if (tree.depth > max_depth) build({.passes = 0});
  return tree;
}

} // namespace packtrace
