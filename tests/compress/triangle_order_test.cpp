#include "compress/bake/clusters/triangle_order.h"

#include <algorithm>
#include <random>
#include <tuple>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

/// Triangles with random ranks and places; places repeat often.
std::vector<PlacedTriangle> random_triangles(uint32_t count, uint32_t ranks, uint32_t place_bits) {
  std::mt19937_64 random(count + ranks);
  std::vector<PlacedTriangle> triangles(count);
  for (uint32_t i = 0; i < count; ++i)
    triangles[i] = {random() >> (64 - place_bits), i, static_cast<uint32_t>(random() % ranks)};
  return triangles;
}

TEST(TriangleOrder, SortsByRankThenPlaceThenNumber) {
  for (const uint32_t count : {0u, 1u, 2u, 2048u, 2049u, 20000u})
    for (const uint32_t ranks : {1u, 3u, 300u})
      for (const uint32_t bits : {1u, 11u, 12u, 63u}) {
        std::vector<PlacedTriangle> sorted = random_triangles(count, ranks, bits), expected = sorted;
        sort_by_place(sorted, ranks);
        const auto key = [](const PlacedTriangle& t) { return std::tuple(t.rank, t.morton, t.triangle); };
        std::sort(expected.begin(), expected.end(),
                  [&](const PlacedTriangle& a, const PlacedTriangle& b) { return key(a) < key(b); });
        EXPECT_TRUE(std::equal(sorted.begin(), sorted.end(), expected.begin(), expected.end(),
                               [&](const PlacedTriangle& a, const PlacedTriangle& b) { return key(a) == key(b); }))
            << count << " " << ranks << " " << bits;
      }
}

} // namespace
} // namespace packtrace
