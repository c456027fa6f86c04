#include "compress/format/pages/position_predictor.h"

#include <algorithm>
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
    for (uint32_t i = 0; i < first_new; ++i) points[i].known = true;
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
    grid.points[point].known = true;
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

TEST(PositionPredictor, ModelsStayInRangeForAnyPositions) {
  Grid grid(3, Grid::kSide + 1);
  const uint32_t point = grid.number(Grid::kSide + 1);
  const PointOrder order = grid.order(point);
  const int64_t largest = std::numeric_limits<int64_t>::max(), least = std::numeric_limits<int64_t>::min();
  for (uint32_t i = 0; i < point; ++i) {
    grid.points[i].position = {i % 2 != 0 ? largest : least, i % 3 != 0 ? largest : 0, i % 5 != 0 ? least : 1};
    grid.points[i].error_bits = {64, 64, 64};
  }
  PositionPredictor predictor;
  predictor.begin();
  for (int i = 0; i < 2000; ++i) {
    predictor.predict(grid.points, grid.triangles, order, point);
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto models = predictor.models(axis);
      EXPECT_GE(models.first, context::kPosition);
      EXPECT_LT(models.first, context::kNormalChoice);
      EXPECT_TRUE(!models.mixed ||
                  (models.second >= context::kPositionNear && models.second < context::kPositionAlone));
      predictor.learn_error(i % 2 != 0 ? largest : least);
    }
    predictor.learn_position({i % 3 != 0 ? largest : least, 0, least});
  }
}

} // namespace
} // namespace packtrace
