#include "compress/bake/clusters/repeated_parts.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/clusters/geometry_clusters.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

constexpr uint32_t kSheetColumns = 12, kSheetRows = 10, kSheetTriangles = 2 * kSheetColumns * kSheetRows;

/// Appends a sheet of kSheetTriangles triangles that is connected to nothing else. Its vertices are at place(i, j).
template <typename Place>
void append_sheet(QuantizedGeometry& geometry, const Place& place, uint32_t kind = 0) {
  const auto first = static_cast<uint32_t>(geometry.positions.size());
  for (uint32_t j = 0; j <= kSheetRows; ++j)
    for (uint32_t i = 0; i <= kSheetColumns; ++i) {
      geometry.vertices.push_back({static_cast<uint32_t>(geometry.positions.size()), 0, {}});
      geometry.positions.push_back(place(i, j));
    }
  for (uint32_t j = 0; j < kSheetRows; ++j)
    for (uint32_t i = 0; i < kSheetColumns; ++i) {
      const uint32_t a = first + j * (kSheetColumns + 1) + i, b = a + 1, c = b + kSheetColumns + 1, d = c - 1;
      geometry.triangles.insert(geometry.triangles.end(), {{a, b, c}, {a, c, d}});
    }
  geometry.kinds.resize(std::max<size_t>(geometry.kinds.size(), kind + 1));
  geometry.kinds[kind].slot = kind;
  geometry.kind_of.resize(geometry.triangles.size(), kind);
}

/// A sheet that is bent and rounded, at a distance along x.
auto bent(int64_t distance) {
  return [distance](uint32_t i, uint32_t j) {
    return LatticePoint{distance + 100 * int64_t{i} + (j + static_cast<uint32_t>(distance)) % 2, 90 * int64_t{j},
                        int64_t{i} * i + int64_t{j} * j};
  };
}

std::vector<RepeatedPart> parts_of(const QuantizedGeometry& geometry) {
  return find_repeated_parts(geometry, std::vector<uint8_t>(geometry.triangles.size(), 0));
}

TEST(RepeatedParts, CopiesAreCutAlike) {
  QuantizedGeometry geometry;
  for (int64_t copy = 0; copy < 5; ++copy) append_sheet(geometry, bent(1999 * copy));
  const std::vector<RepeatedPart> parts = parts_of(geometry);
  ASSERT_EQ(parts.size(), 5u);
  for (uint32_t copy = 0; copy < 5; ++copy) {
    EXPECT_EQ(parts[copy].ends, parts[0].ends);
    ASSERT_EQ(parts[copy].triangles.size(), kSheetTriangles);
    for (uint32_t k = 0; k < kSheetTriangles; ++k)
      ASSERT_EQ(parts[copy].triangles[k], parts[0].triangles[k] + copy * kSheetTriangles);
  }
  EXPECT_EQ(parts[0].ends.back(), kSheetTriangles);
  EXPECT_GE(parts[0].ends.size(), 2u);
}

TEST(RepeatedParts, CopiesThatAreOnlyMovedFollowEachOther) {
  const auto turned = [](int64_t distance) {
    return [distance](uint32_t i, uint32_t j) {
      const LatticePoint p = bent(0)(i, j);
      return LatticePoint{distance + p[1], p[0], p[2]};
    };
  };
  QuantizedGeometry geometry;
  for (int64_t copy = 0; copy < 3; ++copy)
    append_sheet(geometry, bent(10000 * copy)), append_sheet(geometry, turned(10000 * copy + 5000));
  const std::vector<RepeatedPart> parts = parts_of(geometry);
  ASSERT_EQ(parts.size(), 6u);
  std::vector<bool> is_turned;
  for (const RepeatedPart& part : parts) is_turned.push_back(part.triangles[0] / kSheetTriangles % 2 == 1);
  EXPECT_TRUE(std::ranges::is_sorted(is_turned) || std::ranges::is_sorted(is_turned, std::greater<>()));
}

TEST(RepeatedParts, DifferentKindsOrTakenTrianglesAreNotEqual) {
  QuantizedGeometry geometry;
  for (uint32_t copy = 0; copy < 4; ++copy) append_sheet(geometry, bent(2000 * copy), copy % 2);
  const std::vector<RepeatedPart> parts = parts_of(geometry);
  ASSERT_EQ(parts.size(), 4u);
  for (uint32_t i = 0; i < 4; i += 2)
    EXPECT_EQ(geometry.kind_of[parts[i].triangles[0]], geometry.kind_of[parts[i + 1].triangles[0]]);
  std::vector<uint8_t> taken(geometry.triangles.size(), 0);
  taken[7] = taken[2 * kSheetTriangles + 7] = 1; // in both sheets of the first kind
  taken[kSheetTriangles + 7] = 1;                // in one of the second
  const std::vector<RepeatedPart> rest = find_repeated_parts(geometry, taken);
  ASSERT_EQ(rest.size(), 2u);
  for (const RepeatedPart& part : rest) {
    EXPECT_EQ(part.triangles.size(), kSheetTriangles - 1);
    EXPECT_EQ(geometry.kind_of[part.triangles[0]], 0u);
    for (const uint32_t t : part.triangles) EXPECT_EQ(taken[t], 0);
  }
}

/// Clusters of a sheet would be larger in a part whose neighbouring triangles are far apart.
TEST(RepeatedParts, PartsOfAnotherShapeAreLeftOut) {
  const auto mixed = [](uint32_t i, uint32_t j) {
    return LatticePoint{100 * int64_t{i * 5 % (kSheetColumns + 1)} + 50000, 90 * int64_t{j * 3 % (kSheetRows + 1)},
                        i + j};
  };
  QuantizedGeometry geometry;
  append_sheet(geometry, bent(0)), append_sheet(geometry, mixed);
  EXPECT_TRUE(parts_of(geometry).empty());
  append_sheet(geometry, bent(5000));
  const std::vector<RepeatedPart> parts = parts_of(geometry);
  ASSERT_EQ(parts.size(), 2u);
  for (const RepeatedPart& part : parts) EXPECT_NE(part.triangles[0] / kSheetTriangles, 1u);
}

TEST(RepeatedParts, SmallAndSinglePartsAreLeftOut) {
  QuantizedGeometry geometry;
  append_sheet(geometry, bent(0));
  for (uint32_t copy = 0; copy < 3; ++copy) { // quads
    const auto first = static_cast<uint32_t>(geometry.positions.size());
    for (const LatticePoint& p : {LatticePoint{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}}) {
      geometry.vertices.push_back({static_cast<uint32_t>(geometry.positions.size()), 0, {}});
      geometry.positions.push_back({p[0] - 100 * copy - 100, p[1], p[2]});
    }
    geometry.triangles.insert(geometry.triangles.end(), {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  }
  geometry.kind_of.resize(geometry.triangles.size(), 0);
  EXPECT_TRUE(parts_of(geometry).empty());
  EXPECT_TRUE(parts_of({}).empty());
}

TEST(RepeatedParts, EachTriangleIsInOneClusterOfItsKind) {
  test::Random random(5);
  int with_parts = 0; // number of rounds
  for (int round = 0; round < 20; ++round) {
    QuantizedGeometry geometry;
    for (uint32_t copy = 0; copy < 6; ++copy) append_sheet(geometry, bent(2000 * copy), random.bits() % 3);
    for (int k = 0; k < 3; ++k) {
      Triangle& t = geometry.triangles[random.bits() % geometry.triangles.size()];
      if (k == 0) std::swap(t.x, t.y);
      if (k == 1) t = geometry.triangles[random.bits() % geometry.triangles.size()];
      if (k == 2) t.z = random.bits() % static_cast<uint32_t>(geometry.vertices.size()); // connects two sheets
    }
    with_parts += !parts_of(geometry).empty();
    const GeometryClusters clusters = split_geometry(geometry, RepeatedClusters::kMost);
    std::multiset<std::pair<uint32_t, std::array<uint32_t, 3>>> left;
    for (size_t i = 0; i < geometry.triangles.size(); ++i)
      left.emplace(geometry.kind_of[i], test::rotated_to_smallest(geometry.triangles[i]));
    uint32_t next = 0, last_kind = 0;
    for (const ClusterRange& cluster : clusters.clusters) {
      EXPECT_EQ(cluster.first_triangle, next);
      EXPECT_GE(cluster.kind, last_kind);
      next += cluster.triangle_count, last_kind = cluster.kind;
      for (uint32_t k = cluster.first_triangle; k < next; ++k) {
        const auto found = left.find({cluster.kind, test::rotated_to_smallest(clusters.triangles[k])});
        ASSERT_NE(found, left.end());
        left.erase(found);
      }
    }
    EXPECT_TRUE(left.empty());
  }
  EXPECT_GT(with_parts, 10);
}

} // namespace
} // namespace packtrace
