#include "compress/format/cluster/grid_block.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "compress/format/layout/bit_stream.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

std::vector<Triangle> triangles_of(const GridBlock& block) {
  std::vector<Triangle> triangles;
  for (const auto& [x, y, upper] : strip_order(block)) {
    const QuadTriangle& shape = kQuadTriangles[block.diagonal(x, y)][upper ? 1 : 0];
    const auto point = [&](size_t c) { return block.point(x + shape.corners[c][0], y + shape.corners[c][1]); };
    triangles.emplace_back(point(0), point(1), point(2));
  }
  return triangles;
}

/// All block sizes, with equal, alternating and random diagonals.
std::vector<GridBlock> all_blocks() {
  test::Random random(1);
  std::vector<GridBlock> all;
  for (uint32_t columns = 1; columns <= kMaxGridQuads; ++columns)
    for (uint32_t rows = 1; columns * rows <= kMaxGridQuads; ++rows) {
      GridBlock block{columns, rows, 0};
      const uint64_t every = ~uint64_t{0} >> (64 - columns * rows);
      all.push_back(block);
      block.diagonals = every;
      all.push_back(block);
      block.diagonals = 0;
      for (uint32_t quad = 0; quad < columns * rows; ++quad)
        block.diagonals |= uint64_t{(quad % columns + quad / columns) % 2} << quad;
      all.push_back(block);
      block.diagonals = (uint64_t{random.bits()} << 32 | random.bits()) & every;
      all.push_back(block);
    }
  return all;
}

TEST(GridBlock, StripsAreThoseOfItsTriangles) {
  for (const GridBlock& block : all_blocks()) {
    const Strips expected = strips_in_order(triangles_of(block), block.point_count());
    GridStrips strips;
    find_grid_strips(block, strips);
    ASSERT_EQ(strips.layout.triangle_count, block.triangle_count());
    ASSERT_EQ(strips.layout.vertex_count, block.point_count());
    ASSERT_EQ(strips.layout.strip_count, expected.layout.strip_count) << block.columns << "x" << block.rows;
    for (uint32_t v = 0; v < block.point_count(); ++v) ASSERT_EQ(strips.vertex_of_point[expected.vertex_order[v]], v);
    for (uint32_t i = 0; i < block.triangle_count(); ++i) {
      ASSERT_EQ(strips.left[i / 64] >> (i % 64) & 1u, expected.left[i]) << block.columns << "x" << block.rows;
      ASSERT_EQ(strips.restart[i / 64] >> (i % 64) & 1u, expected.restart[i]);
    }
    uint32_t used = 0, named = 0;
    for (uint32_t c = 0; c < expected.corners.size(); ++c) {
      const bool fresh = expected.corners[c] == used;
      used += fresh;
      ASSERT_EQ(strips.corners[c], expected.corners[c]);
      ASSERT_EQ(strips.fresh[c / 64] >> (c % 64) & 1u, fresh ? 1u : 0u);
      if (!fresh) {
        ASSERT_EQ(strips.explicits[named], expected.corners[c]);
        ++named;
      }
    }
  }
}

TEST(GridBlock, DiagonalsFollowFromStrips) {
  for (const GridBlock& block : all_blocks()) {
    if (block.quad_count() == 1) continue; // both diagonals have equal strips
    const Strips strips = strips_in_order(triangles_of(block), block.point_count());
    EXPECT_EQ(diagonals_of(block.columns, block.rows, strips.left), block.diagonals)
        << block.columns << "x" << block.rows;
  }
}

} // namespace
} // namespace packtrace
