#include <algorithm>
#include <array>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include "compress/exchange/gltf/rail_strip.h"

namespace packtrace {
namespace {

using Corners = std::array<uint32_t, 3>;

/// The triangle with its smallest corner first, and the same orientation.
Corners rotated(Corners t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

std::multiset<Corners> faces_of(const std::vector<uint32_t>& list) {
  std::multiset<Corners> faces;
  for (size_t i = 0; i < list.size(); i += 3) faces.insert(rotated({list[i], list[i + 1], list[i + 2]}));
  return faces;
}

/// The triangles of a strip, with the numbers that their vertices had before.
std::multiset<Corners> faces_of(const RailStrip& strip) {
  std::vector<uint32_t> flat;
  for (const auto& [left, right] : strip.elements) flat.insert(flat.end(), {strip.order[left], strip.order[right]});
  std::multiset<Corners> faces;
  for (size_t i = 0; i + 2 < flat.size(); ++i) {
    const uint32_t a = flat[i], b = flat[i + 1], c = flat[i + 2];
    if (a == b || b == c || a == c) continue;
    faces.insert(rotated(i % 2 == 0 ? Corners{a, b, c} : Corners{b, a, c}));
  }
  return faces;
}

void expect_same_faces(const std::vector<uint32_t>& list, size_t vertices) {
  const RailStrip strip = rail_strip(list, vertices);
  EXPECT_EQ(faces_of(strip), faces_of(list));
  const std::set<uint32_t> used(list.begin(), list.end());
  EXPECT_EQ(std::set<uint32_t>(strip.order.begin(), strip.order.end()), used);
  EXPECT_EQ(strip.order.size(), used.size());
}

/// Squares of a grid, each cut in two, in random order.
std::vector<uint32_t> grid(uint32_t side) {
  std::vector<Corners> triangles;
  for (uint32_t y = 0; y + 1 < side; ++y)
    for (uint32_t x = 0; x + 1 < side; ++x) {
      const uint32_t a = y * side + x, b = a + 1, c = a + side, d = c + 1;
      triangles.push_back({a, b, d});
      triangles.push_back({a, d, c});
    }
  std::ranges::shuffle(triangles, std::mt19937(1));
  std::vector<uint32_t> list;
  for (const Corners& t : triangles) list.insert(list.end(), t.begin(), t.end());
  return list;
}

TEST(RailStrips, KeepEveryTriangle) {
  expect_same_faces({0, 1, 2}, 3);
  expect_same_faces({0, 1, 2, 3, 4, 5, 2, 1, 6}, 7);
  expect_same_faces(grid(40), 1600);
  // Tetrahedron, repeated triangles, edges of many triangles, edges of triangles with the same direction.
  expect_same_faces({0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2}, 4);
  expect_same_faces({0, 1, 2, 0, 1, 2, 1, 0, 2, 0, 1, 3, 0, 1, 4, 1, 0, 5}, 6);
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    std::vector<uint32_t> list;
    for (int i = 0; i < 60; ++i) {
      Corners t;
      do
        t = {static_cast<uint32_t>(random() % 12), static_cast<uint32_t>(random() % 12),
             static_cast<uint32_t>(random() % 12)};
      while (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]);
      list.insert(list.end(), t.begin(), t.end());
    }
    expect_same_faces(list, 12);
  }
}

TEST(RailStrips, TakeLessThanTwoFifthsOfAListsBytes) {
  constexpr uint32_t kSide = 200;
  std::vector<uint32_t> list = grid(kSide);
  const RailStrip strip = rail_strip(list, kSide * kSide);
  EXPECT_LT(50 * strip.elements.size(), 26 * list.size() / 3);
  std::vector<unsigned char> coded(meshopt_encodeVertexBufferBound(strip.elements.size(), 8));
  const size_t strip_bytes =
      meshopt_encodeVertexBuffer(coded.data(), coded.size(), strip.elements.data(), strip.elements.size(), 8);
  meshopt_optimizeVertexCacheStrip(list.data(), list.data(), list.size(), kSide * kSide);
  std::vector<uint32_t> vertices(kSide * kSide);
  std::vector<unsigned> numbers(kSide * kSide);
  meshopt_optimizeVertexFetchRemap(numbers.data(), list.data(), list.size(), vertices.size());
  for (uint32_t& index : list) index = numbers[index];
  coded.resize(meshopt_encodeIndexBufferBound(list.size(), vertices.size()));
  const size_t list_bytes = meshopt_encodeIndexBuffer(coded.data(), coded.size(), list.data(), list.size());
  EXPECT_LT(5 * strip_bytes, 2 * list_bytes);
}

} // namespace
} // namespace packtrace
