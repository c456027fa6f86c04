#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/trees/leaf_nodes.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Orders a cluster's triangles so that the triangles of one tree node are consecutive. The groups are the leaf nodes
/// that build_packed_trees() would choose if strips did not constrain the order of triangles.
class NodeGroups {
public:
  /// @param positions lattice positions of the cluster's vertices; 1..256
  /// @param triangles 1..128 triangles, indices into positions
  void find(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);

  std::span<const Triangle> triangles() const { return triangles_; } ///< triangles, group by group
  std::span<const uint8_t> order() const { return order_; }          ///< their numbers in the cluster
  std::span<const uint32_t> ends() const { return ends_; }           ///< end of each group in triangles()

private:
  std::vector<LeafNode> nodes_;
  std::vector<Triangle> triangles_;
  std::vector<uint8_t> order_;
  std::vector<uint32_t> ends_;
};

} // namespace packtrace
