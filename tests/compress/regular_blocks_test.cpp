#include "compress/bake/clusters/regular_blocks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <span>

#include <gtest/gtest.h>

#include "compress/bake/clusters/geometry_clusters.h"
#include "compress/format/file/baked_file.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

/// Makes a geometry of one kind, with one vertex per position.
QuantizedGeometry geometry_of(std::vector<LatticePoint> positions, std::vector<Triangle> triangles) {
  QuantizedGeometry geometry;
  for (uint32_t i = 0; i < positions.size(); ++i) geometry.vertices.push_back({i, 0, {}});
  geometry.positions = std::move(positions);
  geometry.kinds.resize(1);
  geometry.kind_of.assign(triangles.size(), 0);
  geometry.triangles = std::move(triangles);
  return geometry;
}

/// A grid of quads that are all cut along the same diagonal.
QuantizedGeometry grid(uint32_t columns, uint32_t rows, const std::function<LatticePoint(uint32_t, uint32_t)>& place,
                       bool closed = false) {
  const uint32_t width = closed ? columns : columns + 1, height = closed ? rows : rows + 1;
  std::vector<LatticePoint> positions;
  for (uint32_t j = 0; j < height; ++j)
    for (uint32_t i = 0; i < width; ++i) positions.push_back(place(i, j));
  std::vector<Triangle> triangles;
  const auto at = [&](uint32_t i, uint32_t j) { return j % height * width + i % width; };
  for (uint32_t j = 0; j < rows; ++j)
    for (uint32_t i = 0; i < columns; ++i) {
      triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      triangles.emplace_back(at(i + 1, j + 1), at(i, j + 1),
                             at(i, j)); // starts at a corner that blocks do not start at
    }
  return geometry_of(std::move(positions), std::move(triangles));
}

LatticePoint flat(uint32_t i, uint32_t j) { return {100 * int64_t{i}, 100 * int64_t{j}, 0}; }

/// Checks that no triangle is in two blocks. Returns the number of triangles in blocks.
size_t count_triangles(const QuantizedGeometry& geometry, const std::vector<RegularBlock>& blocks) {
  std::set<uint32_t> seen;
  size_t count = 0;
  for (const RegularBlock& block : blocks) {
    count += block.triangle_count;
    EXPECT_LE(block.triangle_count, kMaxClusterTriangles);
    seen.insert(block.triangles.begin(), block.triangles.begin() + block.triangle_count);
  }
  EXPECT_EQ(seen.size(), count);
  EXPECT_TRUE(seen.empty() || *seen.rbegin() < geometry.triangles.size());
  return seen.size();
}

Strips strips_of(const QuantizedGeometry& geometry, const RegularBlock& block) {
  std::map<uint32_t, uint32_t> numbers;
  std::vector<Triangle> triangles;
  for (size_t k = 0; k < block.triangle_count; ++k) {
    Triangle t = block.triangle(geometry, k);
    for (int c = 0; c < 3; ++c) t[c] = numbers.try_emplace(t[c], static_cast<uint32_t>(numbers.size())).first->second;
    triangles.push_back(t);
  }
  return strips_in_order(triangles, static_cast<uint32_t>(numbers.size()));
}

/// Checks that all blocks have 8 x 8 quads and the same strips.
void expect_equal_strips(const QuantizedGeometry& geometry, const std::vector<RegularBlock>& blocks) {
  ASSERT_FALSE(blocks.empty());
  const Strips first = strips_of(geometry, blocks[0]);
  EXPECT_EQ(first.layout.strip_count, 32u);
  EXPECT_EQ(first.layout.vertex_count, 81u);
  for (const RegularBlock& block : blocks) {
    const Strips strips = strips_of(geometry, block);
    EXPECT_EQ(strips.corners, first.corners);
    EXPECT_EQ(strips.left, first.left);
    EXPECT_EQ(strips.restart, first.restart);
  }
}

TEST(RegularBlocks, AllBlocksOfAGridHaveTheSameStrips) {
  test::Random random(1);
  const QuantizedGeometry geometry = grid(80, 48, [&](uint32_t i, uint32_t j) {
    return LatticePoint{100 * int64_t{i} + random.bits() % 30, 100 * int64_t{j} + random.bits() % 30,
                        random.bits() % 80};
  });
  const std::vector<RegularBlock> blocks = find_regular_blocks(geometry, RepeatedClusters::kMany);
  EXPECT_EQ(count_triangles(geometry, blocks), geometry.triangles.size());
  expect_equal_strips(geometry, blocks);
}

/// Cuts quad q of a grid with `columns` columns along the other diagonal.
void turn_diagonal(QuantizedGeometry& geometry, uint32_t columns, uint32_t q) {
  const uint32_t a = q / columns * (columns + 1) + q % columns, d = a + columns + 1;
  geometry.triangles[2 * q] = {a + 1, d, a};
  geometry.triangles[2 * q + 1] = {a + 1, d + 1, d};
}

TEST(RegularBlocks, DiagonalsMayAlternate) {
  for (const uint32_t odd : {0u, 1u}) {
    const QuantizedGeometry all = [&] {
      QuantizedGeometry geometry = grid(80, 48, flat);
      for (uint32_t q = 0; q < geometry.triangles.size() / 2; ++q)
        if ((q % 80 + q / 80) % 2 == odd) turn_diagonal(geometry, 80, q);
      return geometry;
    }();
    const std::vector<RegularBlock> blocks = find_regular_blocks(all, RepeatedClusters::kMany);
    EXPECT_GE(count_triangles(all, blocks), odd == 1 ? all.triangles.size() : all.triangles.size() * 4 / 5);
    expect_equal_strips(all, blocks);
    // A hole and its irregular surroundings do not spoil the rest.
    QuantizedGeometry open = all;
    open.triangles.erase(open.triangles.begin() + 2 * (20 * 80 + 30), open.triangles.begin() + 2 * (20 * 80 + 37));
    open.kind_of.resize(open.triangles.size());
    EXPECT_GE(count_triangles(open, find_regular_blocks(open, RepeatedClusters::kMany)), open.triangles.size() * 3 / 4);
  }
}

TEST(RegularBlocks, DiagonalsMayBeAnyIfTheyAreLongest) {
  test::Random random(4);
  const auto bumps = [&](uint32_t i, uint32_t j) {
    return LatticePoint{100 * int64_t{i} + random.bits() % 10, 80 * int64_t{j} + random.bits() % 10,
                        random.bits() % 10};
  };
  QuantizedGeometry geometry = grid(64, 48, bumps);
  for (uint32_t q = 0; q < geometry.triangles.size() / 2; ++q)
    if (random.bits() % 2 == 0) turn_diagonal(geometry, 64, q);
  const std::vector<RegularBlock> blocks = find_regular_blocks(geometry, RepeatedClusters::kMany);
  EXPECT_EQ(count_triangles(geometry, blocks), geometry.triangles.size());
  for (const RegularBlock& block : blocks) {
    EXPECT_EQ(strips_of(geometry, block).layout.vertex_count, 81u);
    EXPECT_EQ(strips_of(geometry, block).layout.strip_count, 32u);
  }
}

std::span<const uint32_t> triangles_of(const RegularBlock& block) {
  return std::span(block.triangles).first(block.triangle_count);
}

TEST(RegularBlocks, BlocksFillClosedGridsAndAlignWithBorders) {
  const QuantizedGeometry torus = grid(64, 32, flat, true);
  EXPECT_GE(count_triangles(torus, find_regular_blocks(torus, RepeatedClusters::kMany)),
            torus.triangles.size() * 9 / 10);
  const QuantizedGeometry open = grid(35, 19, flat); // holds 5 x 2 blocks of 7 x 9 quads
  EXPECT_EQ(count_triangles(open, find_regular_blocks(open, RepeatedClusters::kMany)), 10u * 126u);
  const QuantizedGeometry tube = grid(300, 12, flat, true);
  EXPECT_GE(count_triangles(tube, find_regular_blocks(tube, RepeatedClusters::kMany)), tube.triangles.size() * 9 / 10);
}

TEST(RegularBlocks, ElongatedQuadsAreGatheredAcross) {
  for (const bool tall : {false, true}) {
    const QuantizedGeometry geometry = grid(64, 64, [&](uint32_t i, uint32_t j) {
      return LatticePoint{int64_t{i} * (tall ? 10 : 50), int64_t{j} * (tall ? 50 : 10), 0};
    });
    const std::vector<RegularBlock> blocks = find_regular_blocks(geometry, RepeatedClusters::kMany);
    EXPECT_EQ(count_triangles(geometry, blocks), geometry.triangles.size());
    for (const RegularBlock& block : blocks) {
      LatticePoint lo{1 << 20, 1 << 20, 0}, hi{};
      for (const uint32_t t : triangles_of(block))
        for (int c = 0; c < 3; ++c)
          for (size_t axis = 0; axis < 2; ++axis) {
            const int64_t q = geometry.positions[geometry.triangles[t][c]][axis];
            lo[axis] = std::min(lo[axis], q), hi[axis] = std::max(hi[axis], q);
          }
      EXPECT_EQ(hi[0] - lo[0], tall ? 160 : 200);
      EXPECT_EQ(hi[1] - lo[1], tall ? 200 : 160);
    }
    EXPECT_EQ(strips_of(geometry, blocks[0]).layout.strip_count, 32u);
  }
}

TEST(RegularBlocks, KindsAndSplitVerticesEndBlocks) {
  QuantizedGeometry geometry = grid(32, 32, flat);
  for (size_t t = 0; t < geometry.triangles.size(); ++t) // another kind from column 12 on
    if (t / 2 % 32 >= 12) geometry.kind_of[t] = 1;
  geometry.kinds.resize(2);
  for (const RegularBlock& block : find_regular_blocks(geometry, RepeatedClusters::kMany))
    for (const uint32_t t : triangles_of(block)) EXPECT_EQ(geometry.kind_of[t], geometry.kind_of[block.triangles[0]]);

  geometry = grid(32, 32, flat);
  for (size_t t = 0; t < geometry.triangles.size(); ++t) // separate vertices from column 12 on
    for (int c = 0; c < 3; ++c)
      if (uint32_t& v = geometry.triangles[t][c]; t / 2 % 32 >= 12 && v % 33 == 12) v += 33 * 33;
  geometry.vertices.resize(2 * geometry.vertices.size());
  for (size_t v = 0; v < geometry.vertices.size(); ++v)
    geometry.vertices[v].position = static_cast<uint32_t>(v % geometry.positions.size());
  const std::vector<RegularBlock> blocks = find_regular_blocks(geometry, RepeatedClusters::kMany);
  EXPECT_GE(count_triangles(geometry, blocks), geometry.triangles.size() * 3 / 4);
  for (const RegularBlock& block : blocks)
    EXPECT_LE(2 * strips_of(geometry, block).layout.vertex_count, block.triangle_count + 36u);
}

TEST(RegularBlocks, PartsWithManyDefectsHaveFewerBlocks) {
  QuantizedGeometry geometry = grid(120, 120, flat);
  for (uint32_t j = 5; j < 120; j += 12) // so many holes that blocks of 64 quads hold less than three fifths
    for (uint32_t i = 5; i < 120; i += 12) geometry.triangles[2 * (j * 120 + i)] = {0, 0, 0};
  std::erase_if(geometry.triangles, [](const Triangle& t) { return t.x == t.y; });
  geometry.kind_of.resize(geometry.triangles.size());
  EXPECT_TRUE(find_regular_blocks(geometry, RepeatedClusters::kMany).empty());
  const std::vector<RegularBlock> blocks = find_regular_blocks(geometry, RepeatedClusters::kMost);
  EXPECT_GE(count_triangles(geometry, blocks), geometry.triangles.size() * 3 / 10);
  EXPECT_EQ(blocks[0].triangle_count, 64u);
}

TEST(RegularBlocks, IrregularMeshesHaveNone) {
  test::Random random(2);
  QuantizedGeometry soup = grid(20, 20, flat);
  for (Triangle& t : soup.triangles) t = {random.bits() % 441, random.bits() % 441, random.bits() % 441};
  EXPECT_TRUE(find_regular_blocks(soup, RepeatedClusters::kMany).empty());
  EXPECT_TRUE(find_regular_blocks({}, RepeatedClusters::kMany).empty());
}

TEST(RegularBlocks, RepeatedAndTurnedTrianglesDoNoHarm) {
  test::Random random(3);
  int with_blocks = 0; // number of rounds
  for (int round = 0; round < 20; ++round) {
    QuantizedGeometry geometry = grid(40, 40, flat, round % 2 != 0);
    for (int k = 0; k < 3; ++k) {
      Triangle& t = geometry.triangles[random.bits() % geometry.triangles.size()];
      if (k % 3 == 0) std::swap(t.x, t.y);
      if (k % 3 == 1) t = geometry.triangles[random.bits() % geometry.triangles.size()];
      if (k % 3 == 2) t.z = random.bits() % static_cast<uint32_t>(geometry.vertices.size());
    }
    const GeometryClusters clusters =
        split_geometry(geometry, round % 4 < 2 ? RepeatedClusters::kMany : RepeatedClusters::kMost);
    std::multiset<std::array<uint32_t, 3>> left;
    for (const Triangle& t : geometry.triangles) left.insert(test::rotated_to_smallest(t));
    for (const Triangle& t : clusters.triangles) {
      const auto found = left.find(test::rotated_to_smallest(t));
      ASSERT_NE(found, left.end());
      left.erase(found);
    }
    EXPECT_TRUE(left.empty());
    with_blocks += std::ranges::any_of(clusters.clusters, [](const ClusterRange& c) { return c.ordered != 0; });
  }
  EXPECT_GT(with_blocks, 10);
}

} // namespace
} // namespace packtrace
