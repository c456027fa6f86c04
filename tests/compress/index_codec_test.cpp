#include "compress/format/cluster/index_codec.h"

#include <algorithm>
#include <utility>

#include <gtest/gtest.h>

#include "compress/format/layout/bit_stream.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

struct EncodedIndices {
  Strips strips;
  std::vector<uint8_t> bytes; // followed by kReadSlackBytes
};

EncodedIndices encode(Strips strips) {
  EncodedIndices result{std::move(strips), {}};
  BitWriter writer;
  write_strips(result.strips, writer);
  EXPECT_EQ(writer.bit_count(), result.strips.layout.total_bits());
  writer.align(1);
  result.bytes = writer.bytes();
  result.bytes.resize(result.bytes.size() + kReadSlackBytes);
  return result;
}

EncodedIndices encode(std::span<const Triangle> triangles, uint32_t vertex_count) {
  return encode(find_strips(triangles, vertex_count));
}

/// Decodes in both ways and compares with the source, up to rotation of each triangle.
void expect_round_trip(std::span<const Triangle> triangles, Strips strips) {
  const EncodedIndices e = encode(std::move(strips));
  ASSERT_TRUE(strips_are_valid(e.bytes.data(), e.strips.layout));
  std::vector<Triangle> decoded(triangles.size());
  decode_triangles(e.bytes.data(), e.strips.layout, 0, decoded);
  std::vector<bool> seen(triangles.size());
  for (uint32_t i = 0; i < triangles.size(); ++i) {
    ASSERT_EQ(decode_triangle(e.bytes.data(), e.strips.layout, i), decoded[i]) << i;
    const uint32_t source = e.strips.triangle_order[i];
    ASSERT_FALSE(seen[source]);
    seen[source] = true;
    const auto& order = e.strips.vertex_order;
    const Triangle t(order[decoded[i].x], order[decoded[i].y], order[decoded[i].z]);
    EXPECT_EQ(test::rotated_to_smallest(t), test::rotated_to_smallest(triangles[source]));
  }
}

void expect_round_trip(std::span<const Triangle> triangles, uint32_t vertex_count) {
  expect_round_trip(triangles, find_strips(triangles, vertex_count));
}

TEST(IndexCodec, GridsRoundTripAndCostLittle) {
  const Mesh grid = test::grid_mesh(8);
  expect_round_trip(grid.triangles, 81);
  const EncodedIndices e = encode(grid.triangles, 81);
  EXPECT_LT(e.strips.layout.total_bits(), 128 * 8u); // one byte per triangle; three u8 indices take three
}

TEST(IndexCodec, GroupsStayTogether) {
  const Mesh grid = test::grid_mesh(8);
  const std::vector<uint32_t> ends = {30, 31, 64, 100, 128};
  const Strips strips = find_strips(grid.triangles, 81, ends);
  const auto group_of = [&](uint32_t triangle) {
    return std::upper_bound(ends.begin(), ends.end(), triangle) - ends.begin();
  };
  uint32_t changes = 0;
  for (size_t i = 1; i < 128; ++i)
    changes += group_of(strips.triangle_order[i]) != group_of(strips.triangle_order[i - 1]);
  EXPECT_EQ(changes, 4u);
  std::vector<uint32_t> order = strips.triangle_order;
  std::sort(order.begin(), order.end());
  for (uint32_t i = 0; i < 128; ++i) ASSERT_EQ(order[i], i);
  EXPECT_LE(strips.layout.strip_count, find_strips(grid.triangles, 81).layout.strip_count + 8u);
}

TEST(IndexCodec, StripsInOrderKeepTheOrder) {
  const Mesh grid = test::grid_mesh(8);
  test::Random random(4);
  std::vector<Triangle> soup;
  for (int i = 0; i < 128; ++i) soup.emplace_back(random.bits() % 9, random.bits() % 9, random.bits() % 9);
  for (const auto& [triangles, vertex_count] : {std::pair{grid.triangles, 81u}, {soup, 9u}, {{{0, 0, 0}}, 1u}}) {
    const Strips strips = strips_in_order(triangles, vertex_count);
    for (uint32_t i = 0; i < triangles.size(); ++i) EXPECT_EQ(strips.triangle_order[i], i);
    expect_round_trip(triangles, strips);
  }
}

TEST(IndexCodec, DegenerateAndRepeatedTrianglesRoundTrip) {
  const std::vector<Triangle> triangles = {{0, 0, 0}, {0, 1, 1}, {0, 1, 2}, {0, 1, 2}, {2, 1, 0}, {1, 2, 2}, {2, 0, 1}};
  expect_round_trip(triangles, 3);
}

TEST(IndexCodec, RandomSoupsRoundTrip) {
  test::Random random(7);
  for (int round = 0; round < 300; ++round) {
    const uint32_t vertices = 1 + random.bits() % 256, count = 1 + random.bits() % 128;
    std::vector<Triangle> triangles;
    for (uint32_t i = 0; i < count; ++i)
      triangles.emplace_back(random.bits() % vertices, random.bits() % vertices, random.bits() % vertices);
    expect_round_trip(triangles, vertices);
  }
}

TEST(IndexCodec, AFullClusterOfSeparateVerticesRoundTrips) {
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < 85; ++i) triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  for (uint32_t i = 85; i < 128; ++i) triangles.emplace_back(255, i, 0);
  expect_round_trip(triangles, 256);
}

TEST(IndexCodec, GoldenBytes) {
  // A strip with a right and a left turn, then a strip of one triangle; see the layout in the header.
  Strips strips;
  strips.layout = {4, 6, 2};
  strips.restart = {1, 0, 0, 1};
  strips.left = {0, 0, 1, 0};
  strips.corners = {0, 1, 2, 3, 4, 4, 0, 5};
  BitWriter writer;
  write_strips(strips, writer);
  writer.align(1);
  // restart 1001, left 0010, fresh 11111001 (first bit lowest), then 3-bit indices 4, 0.
  EXPECT_EQ(writer.bytes(), (std::vector<uint8_t>{0x49, 0x9f, 0x04}));
  std::vector<uint8_t> bytes = writer.bytes();
  bytes.resize(bytes.size() + kReadSlackBytes);
  std::array<Triangle, 4> triangles;
  decode_triangles(bytes.data(), strips.layout, 10, triangles);
  EXPECT_EQ(triangles[0], Triangle(10, 11, 12));
  EXPECT_EQ(triangles[1], Triangle(12, 11, 13)); // right turn: across edge 1-2
  EXPECT_EQ(triangles[2], Triangle(12, 13, 14)); // left turn: keeps 2
  EXPECT_EQ(triangles[3], Triangle(14, 10, 15));
}

TEST(IndexCodec, DamagedBitsAreNoticedOrHarmless) {
  const Mesh grid = test::grid_mesh(8);
  const EncodedIndices e = encode(grid.triangles, 81);
  for (uint32_t bit = 0; bit < e.strips.layout.total_bits(); ++bit) {
    std::vector<uint8_t> damaged = e.bytes;
    damaged[bit / 8] ^= static_cast<uint8_t>(1u << (bit % 8));
    if (!strips_are_valid(damaged.data(), e.strips.layout)) continue;
    std::array<Triangle, kMaxClusterTriangles> triangles;
    decode_triangles(damaged.data(), e.strips.layout, 0, triangles);
    for (uint32_t i = 0; i < 128; ++i) {
      EXPECT_LT(std::max({triangles[i].x, triangles[i].y, triangles[i].z}), 81u);
      EXPECT_EQ(decode_triangle(damaged.data(), e.strips.layout, i), triangles[i]);
    }
  }
}

} // namespace
} // namespace packtrace
