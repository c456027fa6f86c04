#include "compress/format/trees/tree_validation.h"

#include <algorithm>
#include <bit>

#include "compress/format/trees/tree_grid.h"

namespace packtrace {
namespace {

constexpr uint8_t kSeen = baked::kVisibleToCamera | baked::kVisibleToOcclusion;
constexpr int64_t kMaxOrigin = int64_t{1} << 60;
// For the bytes of eight slots: ones, and the highest bits.
constexpr uint64_t kByteOnes = 0x0101010101010101, kByteHighBits = 0x80 * kByteOnes;

/// Set of triangles of one cluster.
struct TriangleSet {
  std::array<uint64_t, 2> words{};

  /// Adds a run of 1..128 triangles; false if one of them is already in the set.
  bool add(uint32_t first, uint32_t count) {
    bool fresh = true;
    for (uint32_t w = 0; w < 2; ++w) {
      const uint32_t lo = std::clamp(first, 64 * w, 64 * w + 64) - 64 * w;
      const uint32_t hi = std::clamp(first + count, 64 * w, 64 * w + 64) - 64 * w;
      if (lo == hi) continue;
      const uint64_t run = (~uint64_t{0} >> (64 - (hi - lo))) << lo;
      fresh &= (words[w] & run) == 0;
      words[w] |= run;
    }
    return fresh;
  }
  uint32_t count() const { return static_cast<uint32_t>(std::popcount(words[0]) + std::popcount(words[1])); }
};

class RecordChecker {
public:
  RecordChecker(const BakedSections& sections, TreeMembers& members) : s_(sections), members_(members) {}

  std::optional<TreeFault> run() {
    members_.tree_of.assign(s_.clusters.size(), baked::kNone);
    members_.ray_classes.assign(s_.clusters.size(), 0);
    if (s_.trees.empty()) return s_.nodes.empty() ? std::nullopt : std::optional(TreeFault{"node", 0, "of no tree"});
    std::vector<uint32_t> tree_of(s_.geometries.size(), baked::kNone);
    uint64_t next_node = 0;
    for (size_t i = 0; i < s_.trees.size(); ++i) {
      const baked::TreeRecord& tree = s_.trees[i];
      if (const char* what = find_fault(i, next_node)) return TreeFault{"tree", i, what};
      next_node += tree.node_count;
      if (tree.geometry != baked::kWorldTree) tree_of[tree.geometry] = static_cast<uint32_t>(i);
    }
    if (next_node != s_.nodes.size()) return TreeFault{"node", next_node, "of no tree"};
    const bool has_world = s_.trees.front().geometry == baked::kWorldTree;
    const std::vector<uint32_t> placed = sole_identity_instances(s_);
    for (size_t i = 0; i < tree_of.size(); ++i) {
      const baked::GeometryRecord& g = s_.geometries[i];
      if (g.cluster_count == 0) continue;
      if (tree_of[i] == baked::kNone) {
        if (!has_world || (g.flags & baked::kWorldSpace) == 0 || placed[i] == baked::kNone)
          return TreeFault{"geometry", i, "no tree"};
        tree_of[i] = 0;
      }
      if (!add_geometry(g, tree_of[i])) return TreeFault{"geometry", i, "lattice beyond that of its tree"};
    }
    return std::nullopt;
  }

private:
  const char* find_fault(size_t number, uint64_t next_node) const {
    const baked::TreeRecord& tree = s_.trees[number];
    if (tree.first_node != next_node || tree.node_count > s_.nodes.size() - next_node) return "node range";
    if (tree.depth > baked::kMaxTreeDepth || tree.reserved != 0) return "depth or reserved field";
    if (tree.geometry == baked::kWorldTree ? number != 0 : tree.geometry >= s_.geometries.size()) return "geometry";
    if (number > 0 && s_.trees[number - 1].geometry != baked::kWorldTree &&
        s_.trees[number - 1].geometry >= tree.geometry)
      return "order";
    if (tree.step_mantissa < kMinStepMantissa || tree.step_mantissa > kMaxStepMantissa ||
        tree.step_exponent < kMinStepExponent || tree.step_exponent > kMaxStepExponent + kMaxTreeStepDoublings)
      return "step";
    for (const int64_t o : tree.origin)
      if (o < -kMaxOrigin || o > kMaxOrigin) return "origin";
    return nullptr;
  }

  bool add_geometry(const baked::GeometryRecord& g, uint32_t number) {
    const baked::TreeRecord& tree = s_.trees[number];
    if (g.step_mantissa != tree.step_mantissa || g.step_exponent - tree.step_exponent > kMaxTreeStepDoublings ||
        tree.step_exponent - g.step_exponent > kMaxTreeStepDoublings)
      return false;
    const TreeGridMap map(tree, g);
    const auto first = static_cast<size_t>(g.first_cluster);
    for (uint32_t i = 0, material_class = 0, of_class = 0; i < g.cluster_count; ++i, ++of_class) {
      for (; material_class < 8 && of_class == g.class_clusters[material_class]; of_class = 0) ++material_class;
      members_.tree_of[first + i] = number;
      members_.ray_classes[first + i] = ray_classes_of(material_class);
      const LatticeBox box = box_of_record(g, s_.clusters[first + i]);
      for (size_t axis = 0; axis < 3; ++axis)
        if (map.floor(box.lo[axis], axis) < -baked::kMaxTreeCoordinate ||
            map.ceil(box.hi[axis], axis) > baked::kMaxTreeCoordinate)
          return false;
    }
    return true;
  }

  const BakedSections& s_;
  TreeMembers& members_;
};

/// Checks the nodes of trees with valid records.
class NodeChecker {
public:
  NodeChecker(const BakedSections& sections, const TreeMembers& members)
      : s_(sections), members_(members), covered_(sections.clusters.size()) {}

  std::optional<TreeFault> run() {
    for (uint32_t i = 0; i < s_.trees.size(); ++i)
      if (const auto fault = check_tree(i)) return fault;
    for (size_t c = 0; c < covered_.size() && !s_.trees.empty(); ++c) {
      const uint32_t expected = (members_.ray_classes[c] & kSeen) != 0 ? s_.clusters[c].triangle_count : 0;
      if (covered_[c].count() != expected) return TreeFault{"cluster", c, "triangles that no leaf holds"};
    }
    return std::nullopt;
  }

private:
  std::optional<TreeFault> check_tree(uint32_t number) {
    const baked::TreeRecord& tree = s_.trees[number];
    nodes_ = s_.nodes.subspan(static_cast<size_t>(tree.first_node), tree.node_count);
    levels_.assign(nodes_.size(), 0);
    uint32_t depth = 0;
    for (uint32_t i = 0; i < nodes_.size(); ++i) {
      if (i == 0) levels_[i] = 1;
      depth = std::max<uint32_t>(depth, levels_[i]);
      const char* what = levels_[i] == 0 ? "no parent" : check_node(i, number);
      if (what != nullptr) return TreeFault{"node", tree.first_node + i, what};
    }
    if (depth != tree.depth) return TreeFault{"tree", number, "depth"};
    return std::nullopt;
  }

  const char* check_node(uint32_t number, uint32_t tree) {
    const baked::PackedNode& node = nodes_[number];
    const uint64_t children = bytes_of(node.children);
    const uint64_t empty =
        (children - kByteOnes) & ~children & kByteHighBits; // its lowest bit belongs to the first empty slot
    const uint32_t used = empty == 0 ? baked::kNodeWidth : static_cast<uint32_t>(std::countr_zero(empty)) / 8;
    if (used == 0) return "no children";
    if (const char* what = check_boxes(node, used)) return what;
    return node.has_leaves() ? check_leaves(node, used, tree) : check_children(node, used, number);
  }

  static uint64_t bytes_of(const std::array<uint8_t, baked::kNodeWidth>& slots) {
    return std::bit_cast<uint64_t>(slots);
  }

  static const char* check_boxes(const baked::PackedNode& node, uint32_t used) {
    if ((node.exponents >> 15) != 0) return "exponents";
    const uint64_t unused = used < baked::kNodeWidth ? ~uint64_t{0} << (8 * used) : 0;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t exponent = node.exponent(axis);
      if (exponent > 23) return "exponents";
      if (node.origin[axis] < -baked::kMaxTreeCoordinate || node.origin[axis] > baked::kMaxTreeCoordinate)
        return "origin";
      const uint64_t lo = bytes_of(node.lo[axis]), hi = bytes_of(node.hi[axis]);
      const uint64_t low_bits_fit =
          (hi | kByteHighBits) - (lo & ~kByteHighBits); // result in the highest bit of each byte
      const uint64_t fits = (hi & ~lo) | (~(hi ^ lo) & low_bits_fit);
      if (((fits | unused) & kByteHighBits) != kByteHighBits || (lo & unused) != unused || (hi & unused) != 0)
        return "boxes";
      // Outward rounding extends less than one unit past the vertices.
      const int64_t end = baked::kMaxTreeCoordinate + (int64_t{1} << exponent);
      if (node.origin[axis] + (int64_t{255} << exponent) >= end &&
          node.origin[axis] + (int64_t{*std::ranges::max_element(node.hi[axis])} << exponent) >= end)
        return "boxes";
    }
    return nullptr;
  }

  const char* check_children(const baked::PackedNode& node, uint32_t used, uint32_t number) {
    if (bytes_of(node.children) != ~uint64_t{0} >> (64 - 8 * used)) return "children";
    if (node.cluster != 0 || node.first_triangle != 0) return "children";
    if (node.first_child <= number || node.first_child >= nodes_.size() || used > nodes_.size() - node.first_child)
      return "child numbers";
    if (levels_[number] == baked::kMaxTreeDepth) return "depth";
    uint32_t classes = 0;
    for (uint32_t child = node.first_child; child < node.first_child + used; ++child) {
      if (levels_[child] != 0) return "child of two nodes";
      levels_[child] = static_cast<uint8_t>(levels_[number] + 1);
      classes |= nodes_[child].ray_classes;
    }
    return node.ray_classes == (classes & kSeen) ? nullptr : "ray classes";
  }

  const char* check_leaves(const baked::PackedNode& node, uint32_t used, uint32_t tree) {
    if (node.first_child != 0) return "child numbers";
    if (node.cluster >= s_.clusters.size() || members_.tree_of[node.cluster] != tree) return "cluster";
    if (node.ray_classes != members_.ray_classes[node.cluster] || (node.ray_classes & kSeen) == 0) return "ray classes";
    // Bytes above kMaxLeafTriangles set their highest bit in the sum below.
    const uint64_t sizes = bytes_of(node.children);
    if (((sizes | (sizes + (127 - baked::kMaxLeafTriangles) * kByteOnes)) & kByteHighBits) != 0) return "leaves";
    if (used < baked::kNodeWidth && sizes >> (8 * used) != 0) return "leaves";
    const auto triangles = static_cast<uint32_t>(sizes * kByteOnes >> 56); // at most 128
    if (node.first_triangle + triangles > s_.clusters[node.cluster].triangle_count) return "leaves";
    return covered_[node.cluster].add(node.first_triangle, triangles) ? nullptr : "triangles of two leaves";
  }

  const BakedSections& s_;
  const TreeMembers& members_;
  std::span<const baked::PackedNode> nodes_; // of the current tree
  std::vector<uint8_t> levels_;              // by node of the current tree; 0 until its parent is found
  std::vector<TriangleSet> covered_;         // by cluster
};

} // namespace

uint8_t ray_classes_of(uint32_t material_class) {
  return static_cast<uint8_t>(((material_class & 1u) == 0 ? baked::kVisibleToCamera : 0) |
                              ((material_class & 2u) == 0 ? baked::kVisibleToOcclusion : 0) |
                              ((material_class & baked::kMaskedClass) != 0 ? baked::kMaskedLeaves : 0));
}

std::vector<uint32_t> sole_identity_instances(const BakedSections& sections) {
  constexpr std::array<float, 12> kIdentity{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  std::vector<uint32_t> uses(sections.geometries.size()), found(uses.size(), baked::kNone);
  for (uint32_t i = 0; i < sections.instances.size(); ++i) {
    const baked::InstanceRecord& instance = sections.instances[i];
    if (instance.geometry >= uses.size()) continue;
    const bool sole = ++uses[instance.geometry] == 1 && instance.world_from_object == kIdentity;
    found[instance.geometry] = sole ? i : baked::kNone;
  }
  return found;
}

std::optional<TreeFault> find_tree_record_fault(const BakedSections& sections, TreeMembers& members) {
  return RecordChecker(sections, members).run();
}

std::optional<TreeFault> find_tree_fault(const BakedSections& sections) {
  TreeMembers members;
  if (const auto fault = find_tree_record_fault(sections, members)) return fault;
  return NodeChecker(sections, members).run();
}

} // namespace packtrace
