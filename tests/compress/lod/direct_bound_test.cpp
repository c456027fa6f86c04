// Tests errors that are measured directly against lower levels instead of summed over levels.

#include "compress/bake/lod/bound/direct_bound.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/lod/bound/triangle_refiner.h"

namespace packtrace::test {
namespace {

/// A flat level 0, a level 1 at `height` above it, and a level 2 simplified from level 1 at `after_height` above level
/// 0.
struct Lift {
  static constexpr uint32_t kSide = 8;
  static constexpr int64_t kStep = 64;
  static constexpr uint32_t kWorst = 10;

  Lift(double height, double after_height) {
    for (const double z : {0.0, height}) add_level(z);
    history = TriangleHistory(static_cast<uint32_t>(triangles.size() / 2));
    history.begin_level();
    std::vector<uint32_t> ends(triangles.size() / 2), below(ends.size());
    std::iota(ends.begin(), ends.end(), 1u), std::iota(below.begin(), below.end(), 0u);
    history.append(ends, below);
    errors.assign(triangles.size(), 0.0);
    std::fill(errors.begin() + static_cast<std::ptrdiff_t>(ends.size()), errors.end(), height);
    for (uint32_t i = 0; i < ends.size(); ++i) {
      const uint32_t number = static_cast<uint32_t>(ends.size()) + i;
      numbers.push_back(number);
      const Triangle t = triangles[number] - Triangle(kPoints);
      before.push_back({t, Triangle(Wedge::kNone), 0, height});
      links.links.push_back({i, i});
    }
    for (uint32_t p = 0; p < kPoints; ++p) {
      const LatticePoint& q = positions[kPoints + p];
      points.emplace_back(q[0], q[1], q[2]);
      mesh.points.emplace_back(q[0], q[1], after_height);
      mesh.stands_for.push_back(p);
    }
    mesh.triangles = before;
    for (LodTriangle& t : mesh.triangles) t.error = std::abs(after_height);
    links.bounds.assign(before.size(), std::abs(after_height));
    // A few triangles get the largest sum of errors, as bound_errors() states them.
    for (uint32_t i = 0; i < kWorst; ++i)
      mesh.triangles[7 * i].error = links.bounds[7 * i] = height + std::abs(after_height - height);
  }

  double bound(double floor) {
    const LevelTriangles levels{positions, vertices, triangles, errors, history};
    bound_directly({levels, {0, 0, 0}, points, before, numbers, floor, false}, mesh, links);
    double largest = 0.0;
    for (const LodTriangle& t : mesh.triangles) largest = std::max(largest, t.error);
    return largest;
  }

  static constexpr uint32_t kPoints = (kSide + 1) * (kSide + 1);
  std::vector<LatticePoint> positions;
  std::vector<QuantizedVertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<double> errors;
  TriangleHistory history;
  std::vector<uint32_t> numbers;
  std::vector<DVec3> points;
  std::vector<LodTriangle> before;
  SimplifyMesh mesh;
  SurfaceLinks links;

private:
  void add_level(double z) {
    const auto first = static_cast<uint32_t>(vertices.size());
    for (uint32_t y = 0; y <= kSide; ++y)
      for (uint32_t x = 0; x <= kSide; ++x) {
        vertices.push_back({static_cast<uint32_t>(positions.size()), 0, {}});
        positions.push_back({kStep * x, kStep * y, static_cast<int64_t>(z)});
      }
    for (uint32_t y = 0; y < kSide; ++y)
      for (uint32_t x = 0; x < kSide; ++x) {
        const uint32_t a = first + y * (kSide + 1) + x, b = a + 1, c = a + kSide + 1, d = c + 1;
        triangles.emplace_back(a, b, d), triangles.emplace_back(a, d, c);
      }
  }
};

TEST(DirectBound, WhatGoesBackToWhereItWasHasNoErrorLeft) {
  Lift lift(20.0, 0.0);
  EXPECT_DOUBLE_EQ(lift.mesh.triangles[0].error, 40.0);
  EXPECT_LT(lift.bound(0.0), 1.0);
}

TEST(DirectBound, IsNeverBelowTheDistance) {
  for (const double after : {-30.0, -5.0, 10.0, 40.0}) {
    Lift lift(20.0, after);
    EXPECT_LE(lift.bound(0.0), 1.25 * std::abs(after) + 1.0);
    for (const LodTriangle& t : lift.mesh.triangles) EXPECT_GE(t.error, std::abs(after)) << after;
  }
}

TEST(DirectBound, WhatIsBelowTheFloorIsNotMeasured) {
  Lift lift(20.0, 0.0);
  EXPECT_DOUBLE_EQ(lift.bound(40.0), 40.0);
}

TEST(DirectBound, HistoryForgetsWhatIsTooFarBack) {
  TriangleHistory history(10);
  for (uint32_t level = 0; level <= TriangleHistory::kDepth; ++level) {
    history.begin_level();
    const std::vector<uint32_t> ends{2, 3}, below{level, level + 1, 7};
    history.append(ends, below);
  }
  EXPECT_TRUE(history.below(9).empty());  // level 0
  EXPECT_TRUE(history.below(10).empty()); // no longer kept
  const auto first = history.below(12), second = history.below(13);
  EXPECT_EQ(std::vector<uint32_t>(first.begin(), first.end()), (std::vector<uint32_t>{1, 2}));
  EXPECT_EQ(std::vector<uint32_t>(second.begin(), second.end()), (std::vector<uint32_t>{7}));
}

/// Adds two triangles for each cell of a square grid.
void add_cells(TriangleSet& set, uint32_t cells, const std::function<DVec3(uint32_t x, uint32_t y)>& point) {
  for (uint32_t y = 0; y < cells; ++y)
    for (uint32_t x = 0; x < cells; ++x) {
      set.add({point(x, y), point(x + 1, y), point(x + 1, y + 1)}, 2 * (cells * y + x));
      set.add({point(x, y), point(x + 1, y + 1), point(x, y + 1)}, 2 * (cells * y + x) + 1);
    }
}

/// Where one triangle lies over many of a flat surface, the distance of its parts from single triangles is large.
TEST(TriangleRefiner, FlatPartsHaveNoTangentialDistance) {
  constexpr uint32_t kCells = 4;
  const auto point = [](uint32_t x, uint32_t y) { return DVec3(x, y, 0.0); };
  TriangleRefiner refiner;
  add_cells(refiner.begin(), kCells, point);
  refiner.measure_corners({DVec3(0.2, 0.1, 0.0), DVec3(3.9, 0.7, 0.0), DVec3(1.3, 3.6, 0.0)});
  double noted = 0.0;
  const double bound = refiner.run([&](double distance, uint32_t) { return distance <= 1e-9; },
                                   [&](uint32_t, double distance) { noted = std::max(noted, distance); });
  EXPECT_LE(bound, 1e-9);
  EXPECT_EQ(bound, noted);
}

/// A side that spans a notch of the border is far from it only between its ends, where no corner shows how far.
TEST(TriangleRefiner, WhatSpansANotchIsAsFarAsItsMiddle) {
  constexpr uint32_t kCells = 8;
  constexpr double kDepth = 0.02;
  const auto point = [](uint32_t x, uint32_t y) { return DVec3(x, x == 4 && y == 0 ? kDepth : 1.0 * y, 0.0); };
  TriangleRefiner refiner;
  add_cells(refiner.begin(), kCells, point);
  refiner.measure_corners({DVec3(0.0, 0.0, 0.0), DVec3(8.0, 0.0, 0.0), DVec3(4.1, 8.0, 0.0)});
  const double bound = refiner.run([](double, uint32_t) { return false; }, [](uint32_t, double) {});
  EXPECT_GE(bound, 0.999 * kDepth);
  EXPECT_LE(bound, 1.25 * kDepth);
}

TEST(TriangleSubtraction, HalvesShareOnlyTheirCut) {
  const std::vector<DVec3> corners = {{0, 0, 0}, {4, 0, 0}, {5, 2, 0}, {3, 4, 0}, {0, 3, 0}};
  const auto area = [](const TriangleSubtraction::Polygon& p) {
    double sum = 0.0;
    for (uint32_t i = 2; i < p.count; ++i)
      sum += 0.5 * glm::cross(p.corners[i - 1] - p.corners[0], p.corners[i] - p.corners[0]).z;
    return sum;
  };
  for (size_t count = 3; count <= corners.size(); ++count) {
    TriangleSubtraction::Polygon whole;
    for (size_t i = 0; i < count; ++i) whole.add(corners[i]);
    const auto [one, other] = TriangleSubtraction::halves(whole);
    EXPECT_NEAR(area(one) + area(other), area(whole), 1e-12) << count;
    EXPECT_GT(std::min(area(one), area(other)), 0.2 * area(whole)) << count;
  }
}

} // namespace
} // namespace packtrace::test
