#pragma once

#include <cstdint>
#include <vector>

namespace packtrace {

/// A triangle and its place along a Z-order curve.
struct PlacedTriangle {
  uint64_t morton = 0;
  uint32_t triangle = 0;
  uint32_t rank = 0; ///< rank of its kind
};

/// Sorts triangles by rank, then by place; equal ones keep their order. Takes linear time, on the calling thread.
/// @param rank_count ranks are below it
void sort_by_place(std::vector<PlacedTriangle>& triangles, uint32_t rank_count);

} // namespace packtrace
