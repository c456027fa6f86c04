#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/cluster/position_grid.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Orders a cluster's triangles so that those of a tree's node follow each other: groups are the nodes with leaves that
/// build_packed_trees() would make of them, had strips no say in their order.
class NodeGroups {
public:
  /// @param positions of a cluster's vertices, on the lattice; 1..256
  /// @param triangles 1..128, into positions
  void find(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);

  std::span<const Triangle> triangles() const { return triangles_; } ///< group after group
  std::span<const uint32_t> ends() const { return ends_; }           ///< of groups

private:
  std::vector<LeafNode> nodes_;
  std::vector<Triangle> triangles_;
  std::vector<uint32_t> ends_;
};

} // namespace packtrace
