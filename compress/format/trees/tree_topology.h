#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Packs what does not follow from the clusters: the leaves and the topology of the nodes above them. The bytes are in
/// parts: per node in order, 128 + number of children, or the number of leaves; per leaf, its triangle count; per leaf
/// node, its first triangle; and per leaf node the cluster number, as a 32-bit zigzag difference to the last one,
/// lowest bytes of all nodes first.
/// Leaf nodes are listed in depth-first order. In the same order children are numbered: a node's children begin at the
/// first number that is still free.
std::vector<uint8_t> pack_tree_topology(const BakedSections& sections);

/// Inverse of pack_tree_topology(): fills in the nodes, with boxes computed from the triangles. Returns false if that
/// is impossible. Checks everything that it relies on, except the order of geometry records and the ranges of their
/// origins and shifts.
/// @param sections without nodes; clusters need not have been validated
/// @param nodes of all trees
bool restore_nodes(const BakedSections& sections, std::span<const uint8_t> topology,
                   std::span<baked::PackedNode> nodes);

} // namespace packtrace
