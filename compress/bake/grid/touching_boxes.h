#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/bounds.h"

namespace packtrace {

/// Whether two boxes have a common point; false if one is empty.
inline bool overlap(const Bounds& a, const Bounds& b) {
  return glm::all(glm::lessThanEqual(a.lo, b.hi)) && glm::all(glm::lessThanEqual(b.lo, a.hi));
}

/// For each queried box, returns the smallest size of any other box that touches or overlaps it, or infinity if there
/// is none. Empty boxes touch nothing. Takes O(n log n) time unless many bounds of the search tree overlap.
/// @param boxes all boxes
/// @param sizes one value per box
/// @param asked indices of the queried boxes
std::vector<double> smallest_touching(std::span<const Bounds> boxes, std::span<const double> sizes,
                                      std::span<const uint32_t> asked);

} // namespace packtrace
