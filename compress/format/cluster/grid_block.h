#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/index_codec.h"

namespace packtrace {

/// Edges of the two triangles of a quad. The quad at (x, y) has its corners at the grid points (x, y) to (x+1, y+1).
enum class QuadEdge : uint8_t { kBelow, kRight, kAbove, kLeft, kDiagonal };

/// One of the two triangles of a quad: its corners in counterclockwise order, and edge e from corner e to the next.
struct QuadTriangle {
  std::array<std::array<uint8_t, 2>, 3> corners; ///< x and y, relative to the quad's (x, y)
  std::array<QuadEdge, 3> edges;

  /// Returns e with edges[e] == edge; 3 if the triangle does not have this edge.
  constexpr uint32_t find(QuadEdge edge) const {
    uint32_t e = 0;
    while (e < 3 && edges[e] != edge) ++e;
    return e;
  }
};

/// kQuadTriangles[diagonal]: the lower and the upper triangle of a quad. Diagonal 0 is between (x, y) and (x+1, y+1),
/// diagonal 1 between (x+1, y) and (x, y+1).
inline constexpr std::array<std::array<QuadTriangle, 2>, 2> kQuadTriangles{
    {{{{{{{0, 0}, {1, 0}, {1, 1}}}, {QuadEdge::kBelow, QuadEdge::kRight, QuadEdge::kDiagonal}},
       {{{{0, 0}, {1, 1}, {0, 1}}}, {QuadEdge::kDiagonal, QuadEdge::kAbove, QuadEdge::kLeft}}}},
     {{{{{{0, 0}, {1, 0}, {0, 1}}}, {QuadEdge::kBelow, QuadEdge::kDiagonal, QuadEdge::kLeft}},
       {{{{1, 0}, {1, 1}, {0, 1}}}, {QuadEdge::kRight, QuadEdge::kAbove, QuadEdge::kDiagonal}}}}}};

inline constexpr uint32_t kMaxGridQuads = kMaxClusterTriangles / 2;

/// A rectangle of a grid of quads, each cut into two triangles.
struct GridBlock {
  uint32_t columns = 0, rows = 0; ///< numbers of quads; at most kMaxGridQuads in all
  uint64_t diagonals = 0;         ///< bit y * columns + x: diagonal of quad (x, y)

  uint32_t diagonal(uint32_t x, uint32_t y) const { return static_cast<uint32_t>(diagonals >> (y * columns + x)) & 1u; }
  uint32_t quad_count() const { return columns * rows; }
  uint32_t triangle_count() const { return 2 * quad_count(); }
  uint32_t point_count() const { return (columns + 1) * (rows + 1); }
  uint32_t point(uint32_t x, uint32_t y) const { return y * (columns + 1) + x; }

  friend bool operator==(const GridBlock&, const GridBlock&) = default;
};

/// A triangle of a GridBlock: its quad and whether it is the upper one.
struct GridTriangle {
  uint32_t x, y;
  bool upper;
};

/// Returns the triangles of a block in strip order. Strips are two quads long, along the longer side of the block, and
/// lie side by side, so that 2 x 2 quads can form a leaf of a tree. Leaves of longer strips are narrow, and have large
/// boxes where the grid is not aligned to the axes. If the side has an odd number of quads, the last strips have three;
/// a block that is one quad wide is a single strip.
std::vector<GridTriangle> strip_order(const GridBlock& block);

/// The strips that strips_in_order() makes of the triangles of a GridBlock in strip order. Bit arrays end with a zero
/// word, because read_bits() reads beyond the last bit.
struct GridStrips {
  IndexLayout layout;
  std::array<uint64_t, kMaxClusterTriangles / 64 + 1> restart{}, left{}; ///< bits per triangle
  std::array<uint64_t, kMaxClusterTriangles / 32 + 1> fresh{};           ///< bits per corner
  std::array<uint8_t, 2 * kMaxClusterTriangles> corners;                 ///< the corner list
  std::array<uint8_t, 2 * kMaxClusterTriangles + 8> explicits{};         ///< vertices of the corners that are not fresh
  std::array<uint8_t, kMaxClusterVertices> vertex_of_point;              ///< vertex numbers by GridBlock::point()
};

/// Computes the strips of a block with at least one quad.
void find_grid_strips(const GridBlock& block, GridStrips& strips);

/// Returns the diagonals of the block of this size that has the given turns. If there is no such block, the result is
/// unspecified.
/// @param left per triangle in strip order: 1 if it follows a left turn
uint64_t diagonals_of(uint32_t columns, uint32_t rows, std::span<const uint8_t> left);

} // namespace packtrace
