#pragma once

#include <span>
#include <vector>

#include "compress/format/trees/box_tree.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// Builds an eight-wide tree over boxes; the root is first. A leaf child is kTopLeaf + the number of its box.
/// @param boxes 1 .. 2^31 - 1 boxes
std::vector<packed::TopNode> build_top_tree(std::span<const TreeBox> boxes);

/// Returns a single node over up to eight boxes; child i is kTopLeaf + i.
packed::TopNode top_node(std::span<const TreeBox> boxes);

/// Number of levels of nodes, at most kMaxTopDepth.
uint32_t top_tree_depth(std::span<const packed::TopNode> nodes);

} // namespace packtrace
