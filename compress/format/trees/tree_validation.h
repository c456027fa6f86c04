#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// What is wrong with trees, and where.
struct TreeFault {
  const char* section;
  uint64_t record;
  const char* what;
};

/// Which tree each cluster belongs to, and which rays see it.
struct TreeMembers {
  std::vector<uint32_t> tree_of;    ///< by cluster of the file; kNone without trees
  std::vector<uint8_t> ray_classes; ///< by cluster: PackedNode::ray_classes of its leaves
};

/// PackedNode::ray_classes of the leaves of a material class.
uint8_t ray_classes_of(uint32_t material_class);

/// The first instance of a geometry, if that is its only one and placed by the identity: then world-space geometry may
/// be in the world's tree. By geometry; else kNone.
std::vector<uint32_t> sole_identity_instances(const BakedSections& sections);

/// Checks tree records: that each geometry with clusters is in one tree, and its vertices within the tree's
/// coordinates. Relies on valid geometry and cluster records, and on nothing else.
std::optional<TreeFault> find_tree_record_fault(const BakedSections& sections, TreeMembers& members);

/// That, and checks nodes: each is the child of one node before it, none lies deeper than its record says, leaves are
/// runs of a cluster's triangles, and each triangle of each cluster that some ray sees is in one leaf. In linear time.
/// Not checked: that boxes hold what lies below.
std::optional<TreeFault> find_tree_fault(const BakedSections& sections);

} // namespace packtrace
