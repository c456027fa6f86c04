#include "compress/format/trees/leaf_restorer.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "compress/format/layout/bit_stream.h"
#include "compress/format/trees/node_writer.h"

namespace packtrace {

void LeafRestorer::begin(const baked::GeometryRecord& geometry, const baked::TreeRecord& tree,
                         const ClusterView& cluster) {
  place_vertices(geometry, tree, cluster);
  begin_placed(cluster.bits(), cluster.layout());
}

void LeafRestorer::begin_placed(const uint8_t* bits, const IndexLayout& layout) {
  read_strips(bits, layout);
  kernels_.number_corners({bits, layout.fresh_bit(), layout.explicit_bit(), layout.corner_count(), layout.vertex_count,
                           layout.index_bits()},
                          vertices_.data());
}

void LeafRestorer::place_vertices(const baked::GeometryRecord& geometry, const baked::TreeRecord& tree,
                                  const ClusterView& cluster) {
  const TreeGridMap map(tree, geometry);
  const auto [x, y, z] = cluster.record().position_bits;
  if (const int32_t doublings = geometry.step_exponent - tree.step_exponent;
      doublings >= 0 && uint32_t{x} + y + z <= kMaxFieldBits) {
    // The whole box lies within the tree's coordinates, so a field has less than 31 bits after the shift. For fields of
    // zero bits any shift works.
    const LatticePoint lo = box_of_record(geometry, cluster.record()).lo;
    const auto base = [&](size_t axis) { return static_cast<int32_t>(map.floor(lo[axis], axis)); };
    kernels_.place_vertices({cluster.bits(),
                             cluster.layout().total_bits(),
                             cluster.vertex_count(),
                             {x, y, z},
                             {base(0), base(1), base(2)},
                             static_cast<uint32_t>(std::min(doublings, 31))},
                            boxes_.data());
    return;
  }
  for (uint32_t v = 0; v < cluster.vertex_count(); ++v) {
    const LatticePoint q = cluster.lattice(v);
    for (size_t axis = 0; axis < 3; ++axis) {
      boxes_[v].lo[axis] = static_cast<int32_t>(map.floor(q[axis], axis));
      boxes_[v].minus_hi[axis] = static_cast<int32_t>(-map.ceil(q[axis], axis));
    }
    boxes_[v].lo[3] = boxes_[v].minus_hi[3] = 0;
  }
}

void LeafRestorer::read_strips(const uint8_t* bits, const IndexLayout& layout) {
  const uint32_t count = layout.triangle_count, low = std::min(count, 64u);
  restart_ = {read_bits64(bits, 0, low), read_bits64(bits, low, count - low)};
  left_ = {read_bits64(bits, count, low), read_bits64(bits, count + uint64_t{low}, count - low)};
  uint32_t strip = 0;
  strips_before_[0] = 0;
  for (uint32_t w = 0; w < 2; ++w)
    for (uint64_t word = restart_[w]; word != 0; word &= word - 1) {
      const uint32_t triangle = 64 * w + static_cast<uint32_t>(std::countr_zero(word));
      strip_begins_[strip] = static_cast<uint8_t>(triangle);
      std::memset(strips_before_.data() + triangle + 1, static_cast<int>(++strip), kMaxClusterTriangles);
    }
}

node_kernels::LeafCorners LeafRestorer::corners_of(uint32_t begin, uint32_t end) const {
  const uint32_t strips = strips_before_[begin];
  const auto first = static_cast<uint16_t>(begin + 2 * strips);
  const auto last = static_cast<uint16_t>(end + 2 * strips_before_[end]);
  const uint32_t word = begin >> 6, bit = begin & 63u;
  if (((restart_[word] >> bit) & 1u) != 0) return {first, last, {first, first}};

  // One kept corner is the corner added before. The other was last replaced at the last turn in the other direction in
  // this strip, by the corner added before that turn. Without such a turn it is still a corner of the strip's first
  // triangle.
  const bool is_left = ((left_[word] >> bit) & 1u) != 0;
  const uint64_t flip = is_left ? ~uint64_t{0} : 0, up_to = ~uint64_t{0} >> (63 - bit);
  const uint64_t here = (left_[word] ^ flip) & up_to, below = word != 0 ? left_[0] ^ flip : 0;
  const int32_t turn =
      here != 0 ? static_cast<int32_t>(64 * word + 63) - std::countl_zero(here) : 63 - std::countl_zero(below);
  const uint32_t strip_begin = strip_begins_[strips - 1];
  const uint32_t newest = strip_begin + 2 * strips; // last corner of the strip's first triangle
  const uint32_t kept = turn > static_cast<int32_t>(strip_begin)
                            ? newest + (static_cast<uint32_t>(turn) - strip_begin) - 1
                            : newest - (is_left ? 2 : 1);
  return {first, last, {static_cast<uint16_t>(first - 1), static_cast<uint16_t>(kept)}};
}

node_kernels::Box LeafRestorer::write(const LeafNode& leaves, uint32_t cluster, uint8_t ray_classes,
                                      baked::PackedNode& node) {
  std::array<node_kernels::LeafCorners, baked::kNodeWidth> corners;
  std::array<node_kernels::Box, baked::kNodeWidth> boxes;
  uint32_t triangle = leaves.first_triangle;
  for (uint32_t leaf = 0; leaf < leaves.leaf_count; ++leaf) {
    const uint32_t end = triangle + leaves.triangles[leaf];
    corners[leaf] = corners_of(triangle, end);
    triangle = end;
  }
  kernels_.box_leaves(boxes_.data(), vertices_.data(), corners.data(), leaves.leaf_count, boxes.data());
  node_kernels::NodeBoxes packed;
  node_kernels::Box whole;
  kernels_.pack_children(boxes.data(), leaves.leaf_count, packed, whole);
  set_boxes(packed, node);
  set_leaves(leaves, cluster, ray_classes, node);
  return whole;
}

node_kernels::Box restore_inner_node(const node_kernels::Kernels& kernels, uint32_t first_child,
                                     std::span<const baked::PackedNode> children,
                                     std::span<const node_kernels::Box> boxes, baked::PackedNode& node) {
  node_kernels::NodeBoxes packed;
  node_kernels::Box whole;
  kernels.pack_children(boxes.data(), static_cast<uint32_t>(children.size()), packed, whole);
  set_boxes(packed, node);
  set_children(first_child, children, node);
  return whole;
}

} // namespace packtrace
