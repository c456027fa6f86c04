#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/quantized_geometry.h"
#include "compress/format/leaf_nodes.h"

namespace packtrace {

/// Orders a cluster's triangles so that those of a tree's node follow each other: groups are the nodes with leaves that
/// build_packed_trees() would make of them, had strips no say in their order.
class NodeGroups {
public:
  /// @param triangles of a cluster, into geometry.vertices
  void find(const QuantizedGeometry& geometry, std::span<const Triangle> triangles);

  std::span<const Triangle> triangles() const { return triangles_; } ///< group after group
  std::span<const uint32_t> ends() const { return ends_; }           ///< of groups

private:
  std::vector<TreeGridBox> boxes_;
  std::vector<LeafNode> nodes_;
  std::vector<Triangle> triangles_;
  std::vector<uint32_t> ends_;
};

} // namespace packtrace
