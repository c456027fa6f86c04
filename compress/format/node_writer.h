#pragma once

#include <span>

#include "compress/format/leaf_nodes.h"
#include "compress/format/packed_node.h"

namespace packtrace {

/// Sets a node's origin, exponents and children's boxes: the smallest exponents, each box rounded outwards.
/// @param boxes 1..8, of children in the order of slots; coordinates within +-kMaxTreeCoordinate
void write_boxes(std::span<const TreeGridBox> boxes, baked::PackedNode& node);

} // namespace packtrace
