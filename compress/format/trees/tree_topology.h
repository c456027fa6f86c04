#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// What of the nodes does not follow from the clusters: which leaves there are and how nodes lie above them. Bytes, in
/// parts: per node in order, 128 + children, or its leaves; per leaf, its triangles; per node with leaves, the first
/// triangle; and, the lowest bytes of all first, its cluster's number, as zigzag difference to that of the last one.
/// Nodes of a tree in order: a node's children begin where the nodes said so far end, and the subtrees of children are
/// said in turn.
std::vector<uint8_t> pack_tree_topology(const BakedSections& sections);

/// The inverse: fills in the nodes, whose boxes follow from the triangles. False where that is not possible; it checks
/// all that it relies on but for geometry records that are not in order, or origins and shifts out of range.
/// @param sections without nodes; clusters need not have been validated
/// @param nodes of all trees
bool restore_nodes(const BakedSections& sections, std::span<const uint8_t> topology,
                   std::span<baked::PackedNode> nodes);

} // namespace packtrace
