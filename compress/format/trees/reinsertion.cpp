#include "compress/format/trees/reinsertion.h"

#include <algorithm>
#include <array>
#include <utility>

namespace packtrace {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr float kMinGain = 0x1p-24f; // relative to the root's area, which has about this rounding error

/// A tree with parent links and free node order, so that subtrees can be moved. Nodes keep their numbers from the
/// BoxTree.
class LinkedTree {
public:
  explicit LinkedTree(const BoxTree& tree) : nodes_(tree.nodes.size()) {
    const double whole = tree.nodes[0].box.half_area();
    scale_ = whole > 0.0 ? 1.0 / whole : 0.0;
    for (uint32_t i = 0; i < nodes_.size(); ++i) {
      const BoxTreeNode& from = tree.nodes[i];
      nodes_[i].box = from.box, nodes_[i].area = area(from.box);
      if (from.count > 1) {
        nodes_[i].children = {i + 1, from.right};
        nodes_[i + 1].parent = nodes_[from.right].parent = i;
      }
    }
  }

  /// Runs one pass. Returns whether a subtree was moved.
  bool reinsert(const ReinsertionConfig& config) {
    std::vector<uint32_t> largest;
    for (uint32_t i = 1; i < nodes_.size(); ++i) largest.push_back(i);
    const std::vector<Node>& nodes = nodes_;
    const auto before = [&nodes](uint32_t a, uint32_t b) {
      return nodes[a].area != nodes[b].area ? nodes[a].area > nodes[b].area : a < b;
    };
    if (largest.size() > config.subtrees) {
      std::nth_element(largest.begin(), largest.begin() + config.subtrees, largest.end(), before);
      largest.resize(config.subtrees);
    }
    std::sort(largest.begin(), largest.end(), before);
    bool moved = false;
    for (const uint32_t node : largest) {
      const uint32_t parent = nodes_[node].parent;
      if (parent == kNone || nodes_[parent].parent == kNone) continue; // the root and its children cannot be removed
      if (const uint32_t place = find_place(node, config.search); place != kNone) move(node, place), moved = true;
    }
    return moved;
  }

  /// Returns the nodes in preorder.
  /// @param from the tree that this one was made from
  BoxTree ordered(const BoxTree& from) const {
    struct Waiting {
      uint32_t node, right_of;
    };
    BoxTree out;
    out.nodes.reserve(nodes_.size()), out.order.reserve(from.order.size());
    std::vector<Waiting> waiting{{0, kNone}};
    while (!waiting.empty()) {
      const Waiting next = waiting.back();
      waiting.pop_back();
      const auto number = static_cast<uint32_t>(out.nodes.size());
      if (next.right_of != kNone) out.nodes[next.right_of].right = number;
      out.nodes.push_back({nodes_[next.node].box, static_cast<uint32_t>(out.order.size()), 1, 0});
      const auto [left, right] = nodes_[next.node].children;
      if (left == kNone) {
        out.order.push_back(from.order[from.nodes[next.node].first]);
        continue;
      }
      waiting.push_back({right, number});
      waiting.push_back({left, kNone});
    }
    for (size_t i = out.nodes.size(); i-- > 0;)
      if (const uint32_t right = out.nodes[i].right; right != 0)
        out.nodes[i].count = out.nodes[i + 1].count + out.nodes[right].count;
    return out;
  }

private:
  struct Node {
    TreeBox box{};
    float area = 0.0f; ///< relative to the root's area
    uint32_t parent = kNone;
    std::array<uint32_t, 2> children{kNone, kNone};
  };

  float area(const TreeBox& box) const { return static_cast<float>(box.half_area() * scale_); }

  static TreeBox joined(TreeBox box, const TreeBox& other) {
    box.extend(other);
    return box;
  }

  uint32_t sibling(uint32_t node) const {
    const auto [left, right] = nodes_[nodes_[node].parent].children;
    return left == node ? right : left;
  }

  /// Returns the node beside which a subtree is best inserted, or kNone if it stays. Searches below each sibling on the
  /// way to the root. The gain of a place is the area that the left ancestors lose, minus the area that the new
  /// ancestors grow by.
  uint32_t find_place(uint32_t node, uint32_t budget) const {
    struct Waiting {
      float gain; ///< gain of a place directly above `node`, before the new parent's area
      uint32_t node;
    };
    std::array<Waiting, 128> waiting; // further entries are skipped
    const TreeBox& box = nodes_[node].box;
    const float own_area = nodes_[node].area;
    uint32_t best = kNone;
    float best_gain = kMinGain;
    const auto take = [&](uint32_t place, float gain) {
      if (gain > best_gain) best = place, best_gain = gain;
    };
    uint32_t from = node, above = nodes_[node].parent;
    float gain = nodes_[above].area;          // the parent is removed; its other child replaces it
    TreeBox rest = nodes_[sibling(node)].box; // bounds of everything below `above` without the subtree
    while (true) {
      size_t size = 0;
      waiting[size++] = {gain, sibling(from)};
      while (size > 0 && budget > 0) {
        const Waiting next = waiting[--size];
        --budget;
        if (next.gain - own_area <= best_gain) continue;
        const Node& place = nodes_[next.node];
        const float with_it = area(joined(place.box, box));
        take(next.node, next.gain - with_it);
        const float below = next.gain - (with_it - place.area);
        if (place.children[0] == kNone || below - own_area <= best_gain || size + 2 > waiting.size()) continue;
        waiting[size++] = {below, place.children[0]};
        waiting[size++] = {below, place.children[1]};
      }
      from = above, above = nodes_[above].parent;
      if (above == kNone || budget == 0) return best;
      if (from != nodes_[node].parent) {
        // Candidate: beside everything else below `from`. The new parent has the current box of `from`.
        const float without = area(rest);
        take(from, gain - without);
        gain += nodes_[from].area - without;
      }
      rest.extend(nodes_[sibling(from)].box);
    }
  }

  /// Inserts a subtree beside a node that is not below it. The subtree's parent moves with it.
  void move(uint32_t node, uint32_t place) {
    const uint32_t parent = nodes_[node].parent, other = sibling(node), left = nodes_[parent].parent;
    replace(parent, other);
    replace(place, parent);
    nodes_[parent].children = {place, node};
    nodes_[place].parent = parent;
    refit(left);
    fit(parent);
    refit(nodes_[parent].parent);
  }

  /// Replaces `old` by `node` among the children of old's parent.
  void replace(uint32_t old, uint32_t node) {
    const uint32_t parent = nodes_[old].parent;
    auto& children = nodes_[parent].children;
    children[children[0] == old ? 0 : 1] = node;
    nodes_[node].parent = parent;
  }

  /// Refits nodes from `node` upwards until a box does not change.
  void refit(uint32_t node) {
    while (node != kNone && fit(node)) node = nodes_[node].parent;
  }

  /// Recomputes the node's box. Returns whether it changed.
  bool fit(uint32_t node) {
    const auto [left, right] = nodes_[node].children;
    const TreeBox before = std::exchange(nodes_[node].box, joined(nodes_[left].box, nodes_[right].box));
    nodes_[node].area = area(nodes_[node].box);
    return nodes_[node].box.lo != before.lo || nodes_[node].box.hi != before.hi;
  }

  std::vector<Node> nodes_;
  double scale_ = 0.0;
};

} // namespace

void reinsert_subtrees(BoxTree& tree, const ReinsertionConfig& config) {
  if (tree.nodes.empty()) return;
  LinkedTree loose(tree);
  bool changed = false;
  for (uint32_t pass = 0; pass < config.passes && loose.reinsert(config); ++pass) changed = true;
  if (changed) tree = loose.ordered(tree);
}

} // namespace packtrace
