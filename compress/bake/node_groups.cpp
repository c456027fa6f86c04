#include "compress/bake/node_groups.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace packtrace {

void NodeGroups::find(const QuantizedGeometry& geometry, std::span<const Triangle> triangles) {
  // As whole numbers below 2^24, which floats hold; coarser where the cluster is larger.
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
  const int shift = std::max(static_cast<int>(std::bit_width(extent)) - 24, 0);

  grid_boxes_.clear(), boxes_.clear();
  for (const Triangle& t : triangles) {
    TreeGridBox& box = grid_boxes_.emplace_back();
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax({position(t.x)[axis], position(t.y)[axis], position(t.z)[axis]});
      box.lo[axis] = static_cast<int32_t>((least - lo[axis]) >> shift);
      box.hi[axis] = static_cast<int32_t>((most - lo[axis]) >> shift);
    }
    TreeBox& rounded = boxes_.emplace_back();
    for (size_t axis = 0; axis < 3; ++axis)
      rounded.lo[axis] = static_cast<float>(box.lo[axis]), rounded.hi[axis] = static_cast<float>(box.hi[axis]);
  }

  const BoxTree tree = build_box_tree(boxes_);
  triangles_.clear(), ordered_.clear(), ends_.clear(), nodes_.clear();
  for (const uint32_t i : tree.order) triangles_.push_back(triangles[i]), ordered_.push_back(grid_boxes_[i]);
  find_leaf_nodes(ordered_, {}, nodes_);
  for (const LeafNode& node : nodes_)
    if (node.first_triangle > 0) ends_.push_back(node.first_triangle);
  ends_.push_back(static_cast<uint32_t>(triangles.size()));
}

} // namespace packtrace
