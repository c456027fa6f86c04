#include "compress/format/trees/stored_nodes.h"

#include <algorithm>
#include <array>
#include <limits>

#include "compress/format/trees/node_writer.h"
#include "compress/format/trees/tree_grid.h"

namespace packtrace {
namespace {

/// A box in 64-bit coordinates, before the range check.
struct WideBox {
  std::array<int64_t, 3> lo, hi;
};

/// Converts to tree coordinates; nothing if the box cannot be one of vertices. Vertices lie within
/// +-kMaxTreeCoordinate, but outward rounding may move the high end slightly beyond, so it is clamped.
std::optional<TreeGridBox> in_coordinates(const WideBox& box) {
  TreeGridBox out;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t hi = std::min<int64_t>(box.hi[axis], baked::kMaxTreeCoordinate);
    if (box.lo[axis] < -baked::kMaxTreeCoordinate || box.lo[axis] > hi) return std::nullopt;
    out.lo[axis] = static_cast<int32_t>(box.lo[axis]), out.hi[axis] = static_cast<int32_t>(hi);
  }
  return out;
}

} // namespace

StoredLeafNodes::StoredLeafNodes(const BakedSections& sections)
    : first_(sections.clusters.size() + 1, 0), tree_of_(sections.clusters.size(), baked::kNone),
      of_tree_(sections.trees.size(), 0) {
  const std::span<const baked::PackedNode> nodes = sections.nodes;
  if (nodes.size() > std::numeric_limits<uint32_t>::max()) return;
  for (uint32_t i = 0; i < sections.trees.size(); ++i)
    for (const baked::PackedNode& node :
         nodes.subspan(static_cast<size_t>(sections.trees[i].first_node), sections.trees[i].node_count)) {
      if (!node.has_leaves()) continue;
      tree_of_[node.cluster] = i;
      ++first_[node.cluster + 1];
      ++of_tree_[i];
    }
  for (size_t c = 0; c + 1 < first_.size(); ++c) first_[c + 1] += first_[c];
  nodes_.resize(first_.back());
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for (uint32_t n = 0; n < nodes.size(); ++n)
    if (nodes[n].has_leaves()) nodes_[next[nodes[n].cluster]++] = n;
  for (size_t c = 0; c + 1 < first_.size(); ++c)
    std::sort(nodes_.begin() + first_[c], nodes_.begin() + first_[c + 1],
              [&](uint32_t a, uint32_t b) { return nodes[a].first_triangle < nodes[b].first_triangle; });
}

std::span<const uint32_t> StoredLeafNodes::of_cluster(uint32_t cluster) const {
  return std::span(nodes_).subspan(first_[cluster], first_[cluster + 1] - first_[cluster]);
}

NodeGridTransfer::NodeGridTransfer(const baked::TreeRecord& from, const baked::TreeRecord& to)
    : possible_(from.step_mantissa == to.step_mantissa &&
                std::abs(from.step_exponent - to.step_exponent) <= kMaxTreeStepDoublings),
      shift_(from.step_exponent - to.step_exponent), from_(from), to_(to) {}

std::optional<TreeGridBox> NodeGridTransfer::move(const baked::PackedNode& node, baked::PackedNode& out) const {
  if (!possible_) return std::nullopt;
  return shift_ == 0 ? translate(node, out) : rescale(node, out);
}

std::optional<TreeGridBox> NodeGridTransfer::translate(const baked::PackedNode& node, baked::PackedNode& out) const {
  WideBox whole;
  std::array<int64_t, 3> origin;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const uint32_t exponent = node.exponent(axis);
    origin[axis] = node.origin[axis] + (from_.origin[axis] - to_.origin[axis]);
    if (origin[axis] < -baked::kMaxTreeCoordinate) return std::nullopt; // the origin may lie below all boxes
    // Unused slots have lo 255 and hi 0, so they do not change minimum and maximum.
    whole.lo[axis] = origin[axis] + (int64_t{*std::ranges::min_element(node.lo[axis])} << exponent);
    whole.hi[axis] = origin[axis] + (int64_t{*std::ranges::max_element(node.hi[axis])} << exponent);
  }
  const std::optional<TreeGridBox> box = in_coordinates(whole);
  if (!box) return std::nullopt;
  out = node;
  for (uint32_t axis = 0; axis < 3; ++axis) out.origin[axis] = static_cast<int32_t>(origin[axis]);
  return box;
}

std::optional<TreeGridBox> NodeGridTransfer::rescale(const baked::PackedNode& node, baked::PackedNode& out) const {
  const TreeGridMap map(to_, from_.step_exponent);
  std::array<TreeGridBox, baked::kNodeWidth> children;
  const auto count = static_cast<size_t>(std::ranges::find(node.children, baked::kNoChild) - node.children.begin());
  for (size_t child = 0; child < count; ++child) {
    WideBox moved;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const int64_t origin = from_.origin[axis] + node.origin[axis];
      const uint32_t exponent = node.exponent(axis);
      moved.lo[axis] = map.floor(origin + (int64_t{node.lo[axis][child]} << exponent), axis);
      moved.hi[axis] = map.ceil(origin + (int64_t{node.hi[axis][child]} << exponent), axis);
    }
    const std::optional<TreeGridBox> box = in_coordinates(moved);
    if (!box) return std::nullopt;
    children[child] = *box;
  }
  out = node;
  write_boxes(std::span(children).first(count), out);
  TreeGridBox all = children[0];
  for (size_t child = 1; child < count; ++child) all.extend(children[child]);
  return all;
}

} // namespace packtrace
