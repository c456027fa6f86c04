#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/proxies/triangle_voxels.h"

namespace packtrace {
namespace {

using Int128 = __int128;

/// Whether a triangle touches a closed cube: no axis separates the corners of one from those of the other.
bool touches(const FineTriangle& t, std::array<int64_t, 3> lo, int64_t edge) {
  using V = std::array<Int128, 3>;
  const auto sub = [](const FinePoint& a, const FinePoint& b) {
    return V{Int128{a[0]} - b[0], Int128{a[1]} - b[1], Int128{a[2]} - b[2]};
  };
  const auto cross = [](const V& a, const V& b) {
    return V{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  std::vector<V> axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::array<V, 3> edges = {sub(t[1], t[0]), sub(t[2], t[1]), sub(t[0], t[2])};
  axes.push_back(cross(edges[0], edges[1]));
  for (size_t e = 0; e < 3; ++e)
    for (size_t a = 0; a < 3; ++a) axes.push_back(cross(axes[a], edges[e]));
  for (const V& axis : axes) {
    const auto along = [&](Int128 x, Int128 y, Int128 z) { return axis[0] * x + axis[1] * y + axis[2] * z; };
    Int128 tri_lo = along(t[0][0], t[0][1], t[0][2]), tri_hi = tri_lo;
    for (const FinePoint& p : t) {
      const Int128 d = along(p[0], p[1], p[2]);
      tri_lo = std::min(tri_lo, d), tri_hi = std::max(tri_hi, d);
    }
    Int128 box_lo = along(lo[0], lo[1], lo[2]), box_hi = box_lo;
    for (int c = 1; c < 8; ++c) {
      const Int128 d = along(lo[0] + (c & 1) * edge, lo[1] + (c >> 1 & 1) * edge, lo[2] + (c >> 2) * edge);
      box_lo = std::min(box_lo, d), box_hi = std::max(box_hi, d);
    }
    if (tri_hi < box_lo || box_hi < tri_lo) return false;
  }
  return true;
}

VoxelSet voxels_of(const std::vector<FineTriangle>& triangles, int64_t edge, VoxelIndex size, VoxelRule rule) {
  VoxelSet set(size);
  for (const FineTriangle& t : triangles)
    TriangleVoxels(t, edge, size, rule).for_each_row([&](uint32_t y, uint32_t z, uint32_t first, uint32_t last) {
      for (uint32_t x = first; x <= last; ++x) set.set({x, y, z});
    });
  return set;
}

std::vector<FineTriangle> random_triangles(uint32_t seed, int64_t range, size_t count) {
  std::mt19937 random(seed);
  std::vector<FineTriangle> triangles(count);
  for (FineTriangle& t : triangles) {
    for (FinePoint& p : t)
      for (int64_t& c : p) c = random() % static_cast<uint32_t>(range + 1);
    if (random() % 4 == 0) t[1] = t[0];                                   // a segment
    if (random() % 4 == 0) t[0][2] = t[1][2] = t[2][2] = t[2][2] / 8 * 8; // on a border of voxels
  }
  return triangles;
}

TEST(TriangleVoxels, ConservativeVoxelsAreThoseThatTheTriangleTouches) {
  const VoxelIndex size = {7, 7, 7};
  for (const FineTriangle& t : random_triangles(1, 56, 2000)) {
    const VoxelSet set = voxels_of({t}, 8, size, VoxelRule::kConservative);
    for (uint32_t z = 0; z < 7; ++z)
      for (uint32_t y = 0; y < 7; ++y)
        for (uint32_t x = 0; x < 7; ++x)
          ASSERT_EQ(set.test({x, y, z}), touches(t, {8 * int64_t{x}, 8 * int64_t{y}, 8 * int64_t{z}}, 8));
  }
}

TEST(TriangleVoxels, LargeCoordinatesDoNotOverflow) {
  constexpr int64_t kEdge = int64_t{1} << 25, kScale = kEdge / 8;
  for (const FineTriangle& small : random_triangles(2, 56, 200)) {
    FineTriangle large = small;
    for (FinePoint& p : large)
      for (int64_t& c : p) c *= kScale;
    for (const VoxelRule rule : {VoxelRule::kConservative, VoxelRule::kSeparating})
      ASSERT_TRUE(voxels_of({small}, 8, {7, 7, 7}, rule) == voxels_of({large}, kEdge, {7, 7, 7}, rule));
  }
}

/// A closed ball of triangles around `center`.
std::vector<FineTriangle> ball(FinePoint center, int64_t radius) {
  std::vector<std::array<double, 3>> points;
  constexpr int kRings = 12, kSides = 16;
  const auto at = [&](int ring, int side) {
    const double a = 3.14159265358979 * ring / kRings, b = 2.0 * 3.14159265358979 * (side % kSides) / kSides;
    const auto r = static_cast<double>(radius);
    const double s = ring == 0 || ring == kRings ? 0.0 : std::sin(a);
    return FinePoint{center[0] + std::llround(r * s * std::cos(b)), center[1] + std::llround(r * s * std::sin(b)),
                     center[2] + std::llround(r * std::cos(a))};
  };
  std::vector<FineTriangle> triangles;
  for (int i = 0; i < kRings; ++i)
    for (int j = 0; j < kSides; ++j) {
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return triangles;
}

TEST(TriangleVoxels, ThinVoxelsSeparateInsideFromOutside) {
  constexpr int64_t kEdge = 1000;
  const VoxelIndex size = {40, 40, 40};
  const std::vector<FineTriangle> triangles = ball({20123, 19877, 20345}, 15000);
  const VoxelSet thin = voxels_of(triangles, kEdge, size, VoxelRule::kSeparating),
                 all = voxels_of(triangles, kEdge, size, VoxelRule::kConservative);
  EXPECT_LT(thin.count() * 10, all.count() * 8);
  thin.for_each([&](VoxelIndex v) { ASSERT_TRUE(all.test(v)); });
  VoxelSet reached(size);
  std::vector<VoxelIndex> open = {{0, 0, 0}};
  while (!open.empty()) {
    const VoxelIndex v = open.back();
    open.pop_back();
    if (reached.test(v) || thin.test(v)) continue;
    reached.set(v);
    for (size_t a = 0; a < 3; ++a) {
      if (v[a] > 0) open.push_back(v), --open.back()[a];
      if (v[a] + 1 < size[a]) open.push_back(v), ++open.back()[a];
    }
  }
  EXPECT_FALSE(reached.test({20, 20, 20}));
}

TEST(TriangleVoxels, ParityFillsWhatLiesInside) {
  constexpr int64_t kEdge = 1000;
  // Centres of voxels lie at odd multiples of 500: this ball has corners and edges exactly on rows of centres.
  for (const FinePoint center : {FinePoint{20500, 20500, 20500}, FinePoint{20123, 19877, 20345}}) {
    VoxelSet inside({40, 40, 40});
    for (const FineTriangle& t : ball(center, 15000)) add_crossings(t, kEdge, inside);
    prefix_parity(inside);
    uint64_t wrong = 0;
    for (uint32_t z = 0; z < 40; ++z)
      for (uint32_t y = 0; y < 40; ++y)
        for (uint32_t x = 0; x < 40; ++x) {
          const double dx = 1000.0 * x + 500 - static_cast<double>(center[0]),
                       dy = 1000.0 * y + 500 - static_cast<double>(center[1]),
                       dz = 1000.0 * z + 500 - static_cast<double>(center[2]),
                       r = std::sqrt(dx * dx + dy * dy + dz * dz);
          if (r < 14200.0) wrong += !inside.test({x, y, z});
          if (r > 15001.0) wrong += inside.test({x, y, z});
        }
    EXPECT_EQ(wrong, 0u);
  }
}

} // namespace
} // namespace packtrace
