#include "compress/format/cluster/grid_block.h"

#include <algorithm>
#include <cassert>

namespace packtrace {
namespace {

/// Returns the length of the strips that begin at quad end - 1 of a row or column and run towards quad 0. Strips of one
/// quad are avoided: strips_in_order() would join neighbouring ones. It would also join all strips of a block that is
/// one quad wide.
uint32_t strip_length(uint32_t end, uint32_t width) { return width == 1 || end <= 3 ? end : 2; }

/// Calls use(x, y, first, last) for all quads in strip order; `first` and `last` say that a strip begins or ends there.
template <class Use>
void for_each_quad(uint32_t columns, uint32_t rows, const Use& use) {
  const bool along_rows = columns >= rows;
  const uint32_t width = along_rows ? rows : columns;
  for (uint32_t end = along_rows ? columns : rows, begin = 0; end > 0; end = begin) {
    begin = end - strip_length(end, width);
    for (uint32_t strip = 0; strip < width; ++strip)
      for (uint32_t i = end; i-- > begin;)
        use(along_rows ? i : strip, along_rows ? strip : i, i + 1 == end, i == begin);
  }
}

/// Corners of a quad: (x, y), (x+1, y), (x+1, y+1), (x, y+1).
enum QuadCorner : uint8_t { kA, kB, kC, kD };

/// How a strip passes through a quad, by the quad's diagonal. Strips along rows run from edge x+1 to edge x, strips
/// along columns from edge y+1 to edge y.
struct QuadPassage {
  std::array<std::array<uint8_t, 4>, 2> first_corners; ///< corner list of a quad that begins a strip
  std::array<std::array<uint8_t, 2>, 2> next_corners;  ///< corner list of a later quad
  std::array<uint8_t, 2> turns_into_next;              ///< turn from this quad into the next one: 1 for left
  std::array<uint8_t, 2> turns_inside; ///< turn across the diagonal, unless the strip begins here: 1 for left

  std::span<const uint8_t> corners(uint32_t diagonal, bool first) const {
    return first ? std::span<const uint8_t>(first_corners[diagonal]) : next_corners[diagonal];
  }
};
constexpr QuadPassage kAlongRows{{{{kB, kC, kA, kD}, {kC, kD, kB, kA}}}, {{{kA, kD}, {kD, kA}}}, {1, 0}, {0, 1}};
constexpr QuadPassage kAlongColumns{{{{kD, kA, kC, kB}, {kC, kD, kB, kA}}}, {{{kA, kB}, {kB, kA}}}, {0, 1}, {1, 0}};

const QuadPassage& passage_of(uint32_t columns, uint32_t rows) { return columns >= rows ? kAlongRows : kAlongColumns; }

/// Numbers of a quad's corners (GridBlock::point()), minus that of (x, y).
std::array<uint32_t, 4> corner_offsets(const GridBlock& block) { return {0, 1, block.columns + 2, block.columns + 1}; }

void set_bit(std::span<uint64_t> bits, uint32_t at, uint64_t value) { bits[at / 64] |= value << (at % 64); }

} // namespace

std::vector<GridTriangle> strip_order(const GridBlock& block) {
  std::vector<GridTriangle> order;
  order.reserve(block.triangle_count());
  const QuadEdge entry = block.columns >= block.rows ? QuadEdge::kRight : QuadEdge::kAbove;
  for_each_quad(block.columns, block.rows, [&](uint32_t x, uint32_t y, bool, bool) {
    const bool upper_first = kQuadTriangles[block.diagonal(x, y)][1].find(entry) < 3;
    order.push_back({x, y, upper_first});
    order.push_back({x, y, !upper_first});
  });
  return order;
}

void find_grid_strips(const GridBlock& block, GridStrips& strips) {
  constexpr uint32_t kUnknown = ~0u;
  const QuadPassage& passage = passage_of(block.columns, block.rows);
  strips.restart = {}, strips.left = {}, strips.fresh = {};
  std::array<uint32_t, kMaxClusterVertices> number; // by point
  std::fill_n(number.begin(), block.point_count(), kUnknown);
  const std::array<uint32_t, 4> offset = corner_offsets(block);
  uint32_t triangle = 0, corner = 0, vertex = 0, named = 0, strip_count = 0, last_diagonal = 0;
  for_each_quad(block.columns, block.rows, [&](uint32_t x, uint32_t y, bool first, bool) {
    const uint32_t diagonal = block.diagonal(x, y), point = block.point(x, y);
    for (const uint8_t c : passage.corners(diagonal, first)) {
      uint32_t& known = number[point + offset[c]];
      const bool fresh = known == kUnknown;
      if (fresh) known = vertex++;
      set_bit(strips.fresh, corner, fresh);
      strips.explicits[named] = static_cast<uint8_t>(known);
      named += !fresh;
      strips.corners[corner++] = static_cast<uint8_t>(known);
    }
    set_bit(strips.restart, triangle, first);
    if (!first) {
      set_bit(strips.left, triangle, passage.turns_into_next[last_diagonal]);
      set_bit(strips.left, triangle + 1, passage.turns_inside[diagonal]);
    }
    triangle += 2;
    strip_count += first;
    last_diagonal = diagonal;
  });
  strips.layout = {triangle, vertex, strip_count};
  for (uint32_t point = 0; point < block.point_count(); ++point)
    strips.vertex_of_point[point] = static_cast<uint8_t>(number[point]);
}

uint64_t diagonals_of(uint32_t columns, uint32_t rows, std::span<const uint8_t> left) {
  assert(left.size() == size_t{2} * columns * rows);
  const QuadPassage& passage = passage_of(columns, rows);
  uint64_t diagonals = 0;
  uint32_t triangle = 0;
  for_each_quad(columns, rows, [&](uint32_t x, uint32_t y, bool first, bool last) {
    uint64_t diagonal = 0; // if the block is a single quad, whose diagonals have the same strips
    if (!first)
      diagonal = left[triangle + 1] == passage.turns_inside[1];
    else if (!last)
      diagonal = left[triangle + 2] == passage.turns_into_next[1];
    diagonals |= diagonal << (y * columns + x);
    triangle += 2;
  });
  return diagonals;
}

} // namespace packtrace
