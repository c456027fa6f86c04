#pragma once

#include <span>
#include <vector>

#include "runtime/gpu/records/gpu_records.h"

namespace packtrace::gpu {

/// Quantises the boxes of a tree over placements, so that kernels test them as they test those of packed nodes. Boxes
/// grow by up to 1/255 of their node's extent, and by what the rounding of the kernels' sums may need.
/// @param nodes finite boxes within [-2^60, 2^60]
std::vector<TopNodeRecord> pack_top_nodes(std::span<const packed::TopNode> nodes);

} // namespace packtrace::gpu
