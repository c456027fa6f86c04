#pragma once

#include <span>
#include <vector>

#include "compress/format/trees/box_tree.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// Eight-wide nodes over boxes, root first; children are kTopLeaf + number of the box.
/// @param boxes 1 .. 2^31 - 1
std::vector<packed::TopNode> build_top_tree(std::span<const TreeBox> boxes);

/// One node over up to eight boxes; children are kTopLeaf + number of the box.
packed::TopNode top_node(std::span<const TreeBox> boxes);

/// Levels of nodes, at most kMaxTopDepth.
uint32_t top_tree_depth(std::span<const packed::TopNode> nodes);

} // namespace packtrace
