#include "compress/format/trees/node_writer.h"

#include <cassert>
#include <cstddef>
#include <cstring>

namespace packtrace {

static_assert(offsetof(baked::PackedNode, exponents) == 12 && offsetof(baked::PackedNode, first_child) == 16 &&
              offsetof(baked::PackedNode, children) == 24 && offsetof(baked::PackedNode, lo) == 32 &&
              offsetof(baked::PackedNode, hi) == 56);
static_assert(offsetof(baked::TreeRecord, origin) == 16 && offsetof(baked::TreeRecord, step_mantissa) == 40);

std::span<const TreeGridBox> triangle_boxes(const ClusterView& cluster, const TreeGridMap& map, ClusterBoxes& room) {
  std::array<Triangle, kMaxClusterTriangles> triangles;
  std::array<TreeGridBox, kMaxClusterVertices> vertices;
  decode_indices(cluster, 0, triangles);
  for (uint32_t v = 0; v < cluster.vertex_count(); ++v) {
    const LatticePoint q = cluster.lattice(v);
    for (size_t axis = 0; axis < 3; ++axis) {
      vertices[v].lo[axis] = static_cast<int32_t>(map.floor(q[axis], axis));
      vertices[v].hi[axis] = static_cast<int32_t>(map.ceil(q[axis], axis));
    }
  }
  for (uint32_t t = 0; t < cluster.triangle_count(); ++t) {
    room[t] = vertices[triangles[t].x];
    room[t].extend(vertices[triangles[t].y]);
    room[t].extend(vertices[triangles[t].z]);
  }
  return std::span(room).first(cluster.triangle_count());
}

void set_boxes(const node_kernels::NodeBoxes& boxes, baked::PackedNode& node) {
  static_assert(sizeof node.lo == sizeof boxes.lo && sizeof node.hi == sizeof boxes.hi);
  std::memcpy(node.origin.data(), boxes.origin, sizeof boxes.origin);
  node.exponents = static_cast<uint16_t>(boxes.exponents);
  std::memcpy(node.lo.data(), boxes.lo, sizeof boxes.lo);
  std::memcpy(node.hi.data(), boxes.hi, sizeof boxes.hi);
}

void set_leaves(const LeafNode& leaves, uint32_t cluster, uint8_t ray_classes, baked::PackedNode& node) {
  node.ray_classes = ray_classes;
  node.first_triangle = static_cast<uint8_t>(leaves.first_triangle);
  node.first_child = 0;
  node.cluster = cluster;
  node.children = leaves.triangles;
}

void set_children(uint32_t first_child, std::span<const baked::PackedNode> children, baked::PackedNode& node) {
  uint32_t classes = 0;
  node.children.fill(baked::kNoChild);
  for (size_t child = 0; child < children.size(); ++child) {
    node.children[child] = baked::kInnerChild;
    classes |= children[child].ray_classes;
  }
  node.ray_classes = static_cast<uint8_t>(classes & (baked::kVisibleToCamera | baked::kVisibleToOcclusion));
  node.first_triangle = 0;
  node.first_child = first_child;
  node.cluster = 0;
}

TreeGridBox write_boxes(std::span<const TreeGridBox> boxes, baked::PackedNode& node) {
  assert(!boxes.empty() && boxes.size() <= baked::kNodeWidth);
  std::array<node_kernels::Box, baked::kNodeWidth> children;
  for (size_t i = 0; i < boxes.size(); ++i) {
    const auto& [lo, hi] = boxes[i];
    children[i] = {{lo[0], lo[1], lo[2], 0}, {-hi[0], -hi[1], -hi[2], 0}};
  }
  node_kernels::NodeBoxes packed;
  node_kernels::Box whole;
  node_kernels::kernels().pack_children(children.data(), static_cast<uint32_t>(boxes.size()), packed, whole);
  set_boxes(packed, node);
  return {{whole.lo[0], whole.lo[1], whole.lo[2]}, {-whole.minus_hi[0], -whole.minus_hi[1], -whole.minus_hi[2]}};
}

TreeGridBox write_leaf_node(const LeafNode& leaves, std::span<const TreeGridBox> boxes, uint32_t cluster,
                            uint8_t ray_classes, baked::PackedNode& node) {
  std::array<TreeGridBox, baked::kNodeWidth> of_leaves;
  uint32_t triangle = leaves.first_triangle;
  for (uint32_t leaf = 0; leaf < leaves.leaf_count; ++leaf) {
    of_leaves[leaf] = boxes[triangle];
    for (const uint32_t end = triangle + leaves.triangles[leaf]; triangle < end; ++triangle)
      of_leaves[leaf].extend(boxes[triangle]);
  }
  set_leaves(leaves, cluster, ray_classes, node);
  return write_boxes(std::span(of_leaves).first(leaves.leaf_count), node);
}

TreeGridBox write_inner_node(uint32_t first_child, uint32_t child_count, std::span<const baked::PackedNode> nodes,
                             std::span<const TreeGridBox> boxes, baked::PackedNode& node) {
  set_children(first_child, nodes.subspan(first_child, child_count), node);
  return write_boxes(boxes.subspan(first_child, child_count), node);
}

} // namespace packtrace
