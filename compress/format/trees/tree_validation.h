#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Fault in trees, and its place.
struct TreeFault {
  const char* section;
  uint64_t record;
  const char* what;
};

/// Tree of each cluster, and the rays that see it.
struct TreeMembers {
  std::vector<uint32_t> tree_of;    ///< by cluster of the file; kNone if there are no trees
  std::vector<uint8_t> ray_classes; ///< by cluster: PackedNode::ray_classes of its leaf nodes
};

/// PackedNode::ray_classes of leaf nodes whose clusters have this material class.
uint8_t ray_classes_of(uint32_t material_class);

/// By geometry: its instance if it has exactly one and that is placed by the identity, else kNone. World-space geometry
/// may belong to the world's tree only if it has such an instance.
std::vector<uint32_t> sole_identity_instances(const BakedSections& sections);

/// Checks tree records: each geometry with clusters belongs to one tree, whose coordinates hold all its vertices.
/// Relies only on valid geometry and cluster records.
std::optional<TreeFault> find_tree_record_fault(const BakedSections& sections, TreeMembers& members);

/// Checks tree records and nodes. Each node but a tree's first is the child of exactly one earlier node, the depth of
/// each tree equals that in its record, leaves are runs of a cluster's triangles, and each triangle of each cluster
/// that some ray sees is in exactly one leaf. Takes linear time. Does not check that boxes contain their triangles.
std::optional<TreeFault> find_tree_fault(const BakedSections& sections);

} // namespace packtrace
