#include "compress/format/pages/position_predictor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

#include "compress/format/pages/point_order.h"

namespace packtrace {
namespace {

/// Rows of quads, as triangles with diagonals from lower left to upper right. Points are numbered row by row, but
/// `last` and the last one have changed their numbers.
struct Grid {
  static constexpr uint32_t kSide = 4; // points per row

  explicit Grid(uint32_t rows, uint32_t last) : last_(last), end_(rows * kSide - 1) {
    points.resize(end_ + size_t{1});
    for (uint32_t i = 0; i <= end_; ++i) points[i].position = place(i);
    for (uint32_t y = 0; y + 1 < rows; ++y)
      for (uint32_t x = 0; x + 1 < kSide; ++x) {
        const uint32_t a = y * kSide + x, b = a + 1, c = a + kSide, d = c + 1;
        add_triangle(points, triangles, {number(a), number(b), number(d)});
        add_triangle(points, triangles, {number(a), number(d), number(c)});
      }
  }
  explicit Grid(uint32_t rows) : Grid(rows, rows * kSide - 1) {}

  uint32_t number(uint32_t i) const { return i == last_ ? end_ : i == end_ ? last_ : i; }
  LatticePoint place(uint32_t point) const {
    const int64_t x = number(point) % kSide, y = number(point) / kSide;
    return {1000 + 700 * x + 300 * y, -500 + 200 * x - 900 * y, 400 * x - 100 * y};
  }
  /// All points below `first_new` are known.
  PointOrder order(uint32_t first_new) {
    PointOrder order;
    order.begin(triangles, end_ + 1, first_new, 0);
    return order;
  }

  std::vector<PagePoint> points;
  PageTriangles triangles;

private:
  uint32_t last_, end_;
};

TEST(PageTriangles, CornersFaceEachOtherAcrossSharedEdges) {
  const Grid grid(3);
  uint32_t open = 0;
  for (uint32_t c = 0; c < grid.triangles.count(); ++c) {
    const uint32_t across = grid.triangles.across[c];
    if (across == kNoPageCorner) {
      ++open;
      continue;
    }
    EXPECT_EQ(grid.triangles.across[across], c);
    const auto point = [&](uint32_t corner) { return grid.triangles.points[corner]; };
    EXPECT_EQ(point(PageTriangles::next(c)), point(PageTriangles::previous(across)));
    EXPECT_EQ(point(PageTriangles::previous(c)), point(PageTriangles::next(across)));
  }
  EXPECT_EQ(open, 2 * (3 + 2u));
}

TEST(PointOrder, EveryNewPointComesOnceAndEnclosedOnesFirst) {
  Grid grid(3);
  PointOrder order = grid.order(Grid::kSide); // the first row is known
  ASSERT_EQ(order.count(), 2 * Grid::kSide);
  std::vector<uint32_t> sequence;
  for (uint32_t i = 0; i < order.count(); ++i) {
    sequence.push_back(order.next());
    order.learn(sequence.back());
  }
  // Of the second row, 5 to 7 lie opposite edges of the first row, 6 and 7 then also beside a known triangle.
  EXPECT_EQ(std::vector(sequence.begin(), sequence.begin() + 3), (std::vector<uint32_t>{5, 6, 7}));
  std::ranges::sort(sequence);
  std::vector<uint32_t> all(order.count());
  std::iota(all.begin(), all.end(), Grid::kSide);
  EXPECT_EQ(sequence, all);
}

TEST(PointOrder, CornersTellWhatIsKnown) {
  Grid grid(3);
  PointOrder order = grid.order(2 * Grid::kSide);
  const uint32_t point = order.next();
  uint32_t both = 0, across = 0;
  for (uint32_t i = 0; i < order.corner_count(point); ++i) {
    const auto corner = order.corner(point, i);
    EXPECT_EQ(grid.triangles.points[corner.corner], point);
    both += corner.both ? 1 : 0, across += corner.across ? 1 : 0;
  }
  EXPECT_EQ(both, 1u);
  EXPECT_EQ(across, 1u);
}

TEST(PositionPredictor, PlaneGridsArePredictedExactlyFromTwoRows) {
  Grid grid(4);
  PointOrder order = grid.order(2 * Grid::kSide);
  PositionPredictor predictor;
  predictor.begin();
  for (uint32_t i = 0; i < order.count(); ++i) {
    const uint32_t point = order.next();
    predictor.predict(grid.points, grid.triangles, order, point);
    for (size_t axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(predictor.coordinate(axis), grid.place(point)[axis]) << point;
      (void)predictor.models(axis);
      predictor.learn_error(0);
    }
    predictor.learn_position(grid.points[point].position);
    order.learn(point);
  }
}

/// Guesses that were wrong many times lose against those that were right.
TEST(PositionPredictor, GuessesOfAClassThatFailsLoseWeight) {
  const uint32_t middle = Grid::kSide + 1;
  Grid grid(3, middle);
  const uint32_t point = grid.number(middle);
  const PointOrder order = grid.order(point);
  grid.points[0].position[2] += 300; // guesses from there are off
  PositionPredictor predictor;
  predictor.begin();
  const auto distance = [&] {
    predictor.predict(grid.points, grid.triangles, order, point);
    return std::abs(predictor.coordinate(2) - grid.place(point)[2]);
  };
  const int64_t before = distance();
  for (int i = 0; i < 50; ++i) {
    (void)distance();
    predictor.learn_position(grid.place(point));
  }
  EXPECT_GT(before, 2 * distance());
}

constexpr int64_t kLargest = std::numeric_limits<int64_t>::max(), kLeast = std::numeric_limits<int64_t>::min();

/// Points of a grid at the ends of 64 bits, all known but those that the test adds to its triangles.
struct ExtremeGrid : Grid {
  ExtremeGrid() : Grid(3, kSide + 1) {
    for (uint32_t i = 0; i < points.size(); ++i) {
      points[i].position = {i % 2 != 0 ? kLargest : kLeast, i % 3 != 0 ? kLargest : 0, i % 5 != 0 ? kLeast : 1};
      points[i].error_bits = {64, 64, 64};
    }
  }
};

/// Predicts a point many times, with errors and positions at the ends of 64 bits, and checks the models' numbers.
void expect_models_in_range(const Grid& grid, const PointOrder& order, uint32_t point, bool mixed) {
  PositionPredictor predictor;
  predictor.begin();
  for (int i = 0; i < 2000; ++i) {
    predictor.predict(grid.points, grid.triangles, order, point);
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto models = predictor.models(axis);
      ASSERT_EQ(models.mixed, mixed);
      ASSERT_GE(models.first, mixed ? context::kPosition : context::kPositionAlone);
      ASSERT_LT(models.first, mixed ? context::kPositionNear : context::kNormalChoice);
      ASSERT_TRUE(!mixed || (models.second >= context::kPositionNear && models.second < context::kPositionAlone));
      predictor.learn_error(i % 2 != 0 ? kLargest : kLeast);
    }
    predictor.learn_position({i % 3 != 0 ? kLargest : kLeast, 0, kLeast});
  }
}

TEST(PositionPredictor, ModelsStayInRangeForAnyPositions) {
  ExtremeGrid grid;
  const uint32_t point = grid.number(Grid::kSide + 1);
  expect_models_in_range(grid, grid.order(point), point, true);
}

TEST(PositionPredictor, ModelsStayInRangeForPointsWithoutGuess) {
  for (const uint32_t neighbours : {2u, 1u, 0u}) { // known ones in the only triangle
    ExtremeGrid grid;
    const auto first = static_cast<uint32_t>(grid.points.size()), corner = grid.triangles.count();
    grid.points.resize(first + 3);
    add_triangle(grid.points, grid.triangles, {neighbours > 0 ? 0 : first + 1, neighbours > 1 ? 2 : first + 2, first});
    PointOrder order;
    order.begin(grid.triangles, first + 3, first, corner);
    expect_models_in_range(grid, order, first, false);
  }
}

/// Triangles that hostile files may hold: around one point, with points more than once.
TEST(PointOrder, FansAndDegenerateTrianglesGiveEveryPointOnce) {
  std::vector<PagePoint> points(kMaxClusterVertices + 2);
  PageTriangles triangles;
  add_triangle(points, triangles, {0, 1, 0}); // of an earlier cluster
  const uint32_t first_corner = triangles.count();
  for (uint32_t i = 0; i < kMaxClusterTriangles; ++i) {
    const uint32_t a = 2 + 2 * i, b = a + 1;
    if (i % 4 == 3)
      add_triangle(points, triangles, {b, a, a});
    else
      add_triangle(points, triangles, {a, i % 4 == 2 ? a : i % 2, b});
  }
  PointOrder order;
  order.begin(triangles, static_cast<uint32_t>(points.size()), 2, first_corner);
  ASSERT_EQ(order.count(), kMaxClusterVertices);
  PositionPredictor predictor;
  predictor.begin();
  for (uint32_t i = 0; i < order.count(); ++i) {
    const uint32_t point = order.next();
    ASSERT_GE(point, 2u);
    ASSERT_LT(point, points.size());
    ASSERT_FALSE(order.known(point));
    predictor.predict(points, triangles, order, point);
    for (size_t axis = 0; axis < 3; ++axis) {
      (void)predictor.models(axis);
      predictor.learn_error(1);
    }
    order.learn(point);
    ASSERT_TRUE(order.known(point));
  }
}

/// More corners and guesses around a point than are used: the prediction stays that of the plane.
TEST(PositionPredictor, UsesSomeOfManyCorners) {
  constexpr uint32_t kRim = 20;
  std::vector<PagePoint> points(2 * kRim + 1);
  PageTriangles triangles;
  for (uint32_t i = 0; i < kRim; ++i) {
    const auto angle = static_cast<double>(i) * 6.283185307179586 / kRim;
    const LatticePoint near{std::lround(1000 * std::cos(angle)), std::lround(1000 * std::sin(angle)), 40};
    points[i].position = near;
    points[kRim + i].position = {2 * near[0], 2 * near[1], 40};
    const uint32_t next = (i + 1) % kRim;
    add_triangle(points, triangles, {i, kRim + i, next});
  }
  const uint32_t corner = triangles.count(), middle = 2 * kRim;
  for (uint32_t i = 0; i < kRim; ++i) add_triangle(points, triangles, {middle, i, (i + 1) % kRim});
  PointOrder order;
  order.begin(triangles, middle + 1, middle, corner);
  ASSERT_EQ(order.corner_count(middle), kRim);
  PositionPredictor predictor;
  predictor.begin();
  predictor.predict(points, triangles, order, middle);
  EXPECT_EQ(predictor.coordinate(2), 40);
}

} // namespace
} // namespace packtrace
