#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace packtrace {

/// A triangle strip whose even and odd indices each mostly repeat or count upwards, so that a codec of differences
/// stores both as two bits. Triangles with equal corners join its parts.
struct RailStrip {
  std::vector<std::array<uint32_t, 2>> elements; ///< even and odd indices: the strip's left and right rail
  std::vector<uint32_t> order;                   ///< by new vertex number: the vertex
};

/// Orders triangles as a strip and numbers their vertices by first use. The strip follows the border of what it has
/// covered, as a spiral does, so the vertices of one rail were numbered in order on the round before and those of the
/// other are new. Keeps the orientation of each triangle, not which corner is its first. Takes O(n log n).
/// @param triangles three vertex numbers each, no two equal
/// @param vertices more than the largest number
RailStrip rail_strip(std::span<const uint32_t> triangles, size_t vertices);

} // namespace packtrace
