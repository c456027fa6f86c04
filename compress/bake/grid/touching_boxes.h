#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/bounds.h"

namespace packtrace {

/// For each of the boxes that are asked about: the least size of any other box that touches or overlaps it, infinity
/// where there is none. Empty boxes touch nothing. Takes O(n log n) unless many boxes overlap in one axis only.
std::vector<double> smallest_touching(std::span<const Bounds> boxes, std::span<const double> sizes,
                                      std::span<const uint32_t> asked);

} // namespace packtrace
