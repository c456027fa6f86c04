#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/scene/bounds.h"

namespace packtrace {

/// How many of the boxes with wanted[i] != 0 touch or overlap any other box, wanted or not. Empty boxes touch nothing.
/// Takes O(n log n) unless many boxes overlap in one axis only.
uint64_t count_touching(std::span<const Bounds> boxes, std::span<const uint8_t> wanted);

} // namespace packtrace
