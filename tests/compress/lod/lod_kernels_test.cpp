// Tests the kernels that measure and place four triangles or edges at once.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/lod/bound/triangle_overlay.h"
#include "compress/bake/lod/bound/triangle_refiner.h"
#include "compress/bake/lod/bound/triangle_set.h"
#include "compress/bake/lod/simplify/edge_heap.h"
#include "compress/bake/lod/simplify/edge_placement.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

DVec3 random_point(Random& random) {
  return 100.0 * DVec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

/// A surface for overlays.
struct Surface {
  std::vector<DVec3> points;
  std::vector<LodTriangle> triangles;
  OverlaySurface view() const { return {points, triangles}; }
  std::vector<uint32_t> all() const {
    std::vector<uint32_t> numbers(triangles.size());
    for (uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
    return numbers;
  }
  std::array<DVec3, 3> corners(size_t i) const {
    const Triangle& t = triangles[i].points;
    return {points[t.x], points[t.y], points[t.z]};
  }
};

/// A square [0, 100]^2 of cells x cells, with points displaced vertically by up to `height`.
Surface bumpy_square(uint32_t cells, float height, uint32_t seed) {
  Random random(seed);
  Surface s;
  for (uint32_t y = 0; y <= cells; ++y)
    for (uint32_t x = 0; x <= cells; ++x)
      s.points.emplace_back(100.0 * x / cells, 100.0 * y / cells, random.uniform(-height, height));
  for (uint32_t y = 0; y < cells; ++y)
    for (uint32_t x = 0; x < cells; ++x) {
      const uint32_t a = y * (cells + 1) + x, b = a + cells + 1;
      s.triangles.push_back({Triangle(a, a + 1, b + 1), Triangle(Wedge::kNone), 0, 0.0});
      s.triangles.push_back({Triangle(a, b + 1, b), Triangle(Wedge::kNone), 0, 0.0});
    }
  return s;
}

Surface random_triangles(uint32_t count, uint32_t seed) {
  Random random(seed);
  Surface s;
  for (uint32_t i = 0; i < count; ++i) {
    const DVec3 a = random_point(random), b = i % 9 == 0 ? a : random_point(random);
    const DVec3 c = i % 7 == 0 ? a + 0.5 * (b - a) : random_point(random);
    for (const DVec3& p : {a, b, c}) s.points.push_back(p);
    s.triangles.push_back({Triangle(3 * i, 3 * i + 1, 3 * i + 2), Triangle(Wedge::kNone), 0, 0.0});
  }
  return s;
}

/// Distances of points from the triangles of a set.
class Rows {
public:
  Rows(const TriangleSet& set, const std::vector<DVec3>& points)
      : width_(set.padded_size()), values_(points.size() * width_) {
    std::vector<double*> rows;
    for (size_t k = 0; k < points.size(); ++k) rows.push_back(&values_[k * width_]);
    set.distances(points, rows);
  }
  const double* row(size_t point) const { return &values_[point * width_]; }

private:
  size_t width_;
  std::vector<double> values_;
};

TEST(TriangleSet, DistancesAreThoseOfTheNearestPoints) {
  const Surface s = random_triangles(101, 1);
  TriangleSet all, odd;
  for (const uint32_t t : s.all()) all.add(s.view(), t);
  for (size_t i = 1; i < all.size(); i += 2) odd.add(all, i);
  ASSERT_EQ(all.size(), 101u);
  ASSERT_EQ(odd.size(), 50u);
  Random random(2);
  for (int repeat = 0; repeat < 100; ++repeat) {
    const std::vector<DVec3> points = {1.5 * random_point(random), random_point(random)};
    const auto expected = [&](DVec3 p, uint32_t t) {
      const std::array<DVec3, 3> c = s.corners(t);
      return glm::length(p - nearest_point(p, c[0], c[1], c[2]));
    };
    for (const TriangleSet* set : {&all, &odd}) {
      const Rows rows(*set, points);
      for (size_t k = 0; k < points.size(); ++k) {
        for (size_t i = 0; i < set->size(); ++i) EXPECT_NEAR(rows.row(k)[i], expected(points[k], set->number(i)), 1e-9);
        for (size_t i = set->size(); i < set->padded_size(); ++i) EXPECT_GE(rows.row(k)[i], 1e100);
      }
    }
  }
}

TEST(TriangleSet, TheNearestIsTheFirstOfWhichNoCornerIsFartherThanOfOthers) {
  Random random(12);
  for (uint32_t count = 1; count < 40; ++count) {
    const Surface s = random_triangles(count, count);
    TriangleSet set;
    for (int twice = 0; twice < 2; ++twice)
      for (const uint32_t t : s.all()) set.add(s.view(), t);
    const Rows rows(set, {random_point(random), random_point(random), random_point(random)});
    const NearestTriangle nearest = set.nearest(rows.row(0), rows.row(1), rows.row(2));
    std::array<double, 3> least{1e300, 1e300, 1e300};
    std::pair<double, uint64_t> best{1e300, 0};
    for (size_t i = 0; i < set.size(); ++i) {
      for (size_t k = 0; k < 3; ++k) least[k] = std::min(least[k], rows.row(k)[i]);
      best = std::min(best, {std::max({rows.row(0)[i], rows.row(1)[i], rows.row(2)[i]}), i});
    }
    EXPECT_LT(best.second, count); // every triangle is in the set twice
    EXPECT_EQ(nearest.place, best.second);
    EXPECT_EQ(nearest.distance, best.first);
    EXPECT_EQ(nearest.least, *std::max_element(least.begin(), least.end()));
  }
}

TEST(TriangleRefiner, BoundsTheDistanceOfEveryPoint) {
  const Surface coarse = bumpy_square(6, 10.0f, 13), fine = bumpy_square(9, 10.0f, 14);
  TriangleRefiner refiner;
  for (const double enough : {0.0, 6.0})
    for (size_t t = 0; t < fine.triangles.size(); ++t) {
      const std::array<DVec3, 3> p = fine.corners(t);
      TriangleSet& among = refiner.begin();
      for (const uint32_t s : coarse.all()) among.add(coarse.view(), s);
      const double farthest = refiner.measure_corners(p);
      double noted = 0.0;
      const double bound = refiner.run([&](double distance, uint32_t) { return distance <= enough; },
                                       [&](uint32_t, double distance) { noted = std::max(noted, distance); });
      double sampled = 0.0;
      for (int i = 0; i <= 12; ++i)
        for (int k = 0; k <= 12 - i; ++k) {
          const DVec3 q = p[0] + (i / 12.0) * (p[1] - p[0]) + (k / 12.0) * (p[2] - p[0]);
          double distance = 1e300;
          for (const uint32_t s : coarse.all()) distance = std::min(distance, coarse.view().distance(q, s));
          sampled = std::max(sampled, distance);
        }
      EXPECT_EQ(bound, noted);
      EXPECT_LE(farthest, sampled + 1e-9);
      EXPECT_LE(sampled, bound + 1e-9);
      EXPECT_LE(bound, std::max(enough, 1.15 * sampled)); // refinement stops within 1.1 of the lower bound
    }
}

TEST(Overlay, PiecesBoundTheDistanceOfTheTriangle) {
  const Surface coarse = bumpy_square(7, 5.0f, 3), fine = bumpy_square(11, 5.0f, 4);
  const std::vector<uint32_t> all = coarse.all();
  Overlay overlay(coarse.view());
  for (size_t t = 0; t < fine.triangles.size(); ++t) {
    const std::array<DVec3, 3> p = fine.corners(t);
    std::vector<OverlayPiece> pieces;
    ASSERT_TRUE(overlay.overlay(p, DVec3(0, 0, 1), all, pieces)) << t;
    double bound = 0.0, nearest_bound = 0.0;
    for (const OverlayPiece& piece : pieces) {
      bound = std::max(bound, piece.distance);
      const double nearest = overlay.nearest_distance(piece);
      EXPECT_LE(nearest, piece.distance);
      nearest_bound = std::max(nearest_bound, nearest);
    }
    for (int i = 0; i <= 10; ++i)
      for (int k = 0; k <= 10 - i; ++k) {
        const DVec3 q = p[0] + 0.1 * i * (p[1] - p[0]) + 0.1 * k * (p[2] - p[0]);
        double distance = 1e300;
        for (const uint32_t s : all) distance = std::min(distance, coarse.view().distance(q, s));
        EXPECT_LE(distance, nearest_bound + 1e-9);
        EXPECT_LE(distance, bound + 1e-9);
      }
  }
}

TEST(Overlay, ACoincidingTriangleIsOnePiece) {
  const Surface s = bumpy_square(5, 5.0f, 5);
  const std::vector<uint32_t> all = s.all();
  Overlay overlay(s.view());
  for (const uint32_t t : all) {
    std::vector<OverlayPiece> pieces;
    ASSERT_TRUE(overlay.overlay(s.corners(t), s.view().area_normal(t), all, pieces));
    ASSERT_EQ(pieces.size(), 1u);
    EXPECT_EQ(pieces[0].triangle, t);
    EXPECT_EQ(pieces[0].inner_sides, 0u);
    EXPECT_LT(pieces[0].distance, 1e-9);
  }
}

TEST(Overlay, HolesAndSecondLayersAreNoCover) {
  const Surface s = bumpy_square(4, 5.0f, 6), other = bumpy_square(3, 0.0f, 7);
  Overlay overlay(s.view());
  const std::array<DVec3, 3> p = other.corners(8);
  std::vector<OverlayPiece> pieces;
  ASSERT_TRUE(overlay.overlay(p, DVec3(0, 0, 1), s.all(), pieces));
  const std::vector<OverlayPiece> whole = pieces;
  ASSERT_GE(whole.size(), 2u);
  for (const OverlayPiece& left_out : whole) {
    std::vector<uint32_t> with_hole = s.all();
    std::erase(with_hole, left_out.triangle);
    EXPECT_FALSE(overlay.overlay(p, DVec3(0, 0, 1), with_hole, pieces));
  }
  std::vector<uint32_t> twice = {whole[0].triangle, whole[0].triangle};
  for (const OverlayPiece& piece : whole) twice.push_back(piece.triangle);
  EXPECT_FALSE(overlay.overlay(p, DVec3(0, 0, 1), twice, pieces));
  EXPECT_FALSE(overlay.overlay(p, DVec3(0, 0, -1), s.all(), pieces)); // seen from behind
  EXPECT_FALSE(overlay.overlay(p, DVec3(1, 0, 0), s.all(), pieces));  // edge-on
  EXPECT_EQ(pieces.size(), whole.size());                             // nothing was appended
}

TEST(Overlay, HalfCoveredTwiceIsNotCovered) {
  const Surface s{{{0, 0, 0}, {2, 0, 0}, {1, 1, 0}, {0, 0, 1}, {2, 0, 1}, {1, 1, 1}, {0, 2, 0}}, {}};
  Surface layers = s, whole = s;
  for (const Triangle& t : {Triangle(0, 1, 2), Triangle(3, 4, 5)})
    layers.triangles.push_back({t, Triangle(Wedge::kNone), 0, 0.0});
  for (const Triangle& t : {Triangle(0, 1, 2), Triangle(0, 2, 6)})
    whole.triangles.push_back({t, Triangle(Wedge::kNone), 0, 0.0});
  const std::array<DVec3, 3> p{DVec3(0, 0, 0), DVec3(2, 0, 0), DVec3(0, 2, 0)};
  std::vector<OverlayPiece> pieces;
  // although the areas add up to the triangle's
  EXPECT_FALSE(Overlay(layers.view()).overlay(p, DVec3(0, 0, 1), layers.all(), pieces));
  EXPECT_TRUE(Overlay(whole.view()).overlay(p, DVec3(0, 0, 1), whole.all(), pieces));
}

TEST(EdgeHeap, GivesEdgesByCostThenNumber) {
  Random random(8);
  EdgeHeap heap;
  std::vector<std::pair<float, uint32_t>> expected;
  for (uint32_t i = 0; i < 1000; ++i) {
    const float cost = std::floor(random.uniform(0, 100)) * (i % 50 == 0 ? 1e-42f : 1e10f);
    heap.add(cost, i);
    expected.emplace_back(cost, i);
  }
  heap.sort();
  std::sort(expected.begin(), expected.end());
  for (const auto& [cost, edge] : expected) {
    ASSERT_FALSE(heap.empty());
    EXPECT_EQ(heap.top(), edge);
    heap.pop();
  }
  EXPECT_TRUE(heap.empty());
}

TEST(EdgeHeap, OrdersEdgesWhoseCostsChange) {
  EdgeHeap heap;
  for (uint32_t i = 0; i < 40; ++i) heap.add(i, i);
  heap.sort();
  ASSERT_EQ(heap.near_count(), EdgeHeap::kNear);
  std::vector<float> cost(40);
  for (uint32_t i = 0; i < cost.size(); ++i) cost[i] = static_cast<float>(i);
  for (size_t place = 0; place < heap.near_count(); ++place) { // some costs go up, some down
    cost[heap.near(place)] = place % 2 == 0 ? 20.5f + static_cast<float>(place) : 0.25f;
    heap.change_near(place, cost[heap.near(place)]);
  }
  heap.restore_order();
  for (float last = 0.0f; !heap.empty(); heap.pop()) {
    EXPECT_GE(cost[heap.top()], last);
    last = cost[heap.top()];
  }
}

/// Edges between points with random quadrics, some of them on borders or locked.
struct PlacementTask {
  explicit PlacementTask(Random& random) {
    for (CollapsePoint& p : points) {
      p = {};
      for (int plane = 0; plane < 5; ++plane) { // a sum of squared distances from planes
        const double n[4] = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1),
                             random.uniform(-9, 9)};
        for (int i = 0, k = 0; i < 3; ++i)
          for (int l = i; l < 3; ++l) p.quadric[k++] += n[i] * n[l];
        for (int i = 0; i < 3; ++i) p.quadric[6 + i] += n[i] * n[3];
        p.quadric[9] += n[3] * n[3];
      }
      for (double& x : p.at) x = std::round(random.uniform(-20, 20));
      p.held = static_cast<double>(random.bits() % 4);
    }
    for (int axis = 0; axis < 3; ++axis) rules.lo[axis] = -30.0, rules.hi[axis] = 30.0;
    for (EdgeEnds& e : edges) e = {random.bits() % 4, 4 + random.bits() % 4};
  }
  void run(PlacementKernel kernel) { kernel(points.data(), rules, edges.data(), edges.size(), placed.data()); }

  std::array<CollapsePoint, 8> points;
  PlacementRules rules{};
  std::array<EdgeEnds, 6> edges{}; // more than four, and not a multiple of four
  std::array<EdgePlacement, 6> placed{};
};

TEST(EdgePlacement, IsNoWorseThanTheEnds) {
  Random random(9);
  for (int repeat = 0; repeat < 300; ++repeat) {
    PlacementTask task(random);
    task.rules.ends_only = repeat % 3 == 0;
    task.run(place_edges);
    for (size_t e = 0; e < task.edges.size(); ++e) {
      const CollapsePoint &a = task.points[task.edges[e].a], &b = task.points[task.edges[e].b];
      const EdgePlacement& placed = task.placed[e];
      const auto cost = [&](const double* p) {
        const auto q = [&](int i) { return a.quadric[i] + b.quadric[i]; };
        return p[0] * p[0] * q(0) + 2 * p[0] * p[1] * q(1) + 2 * p[0] * p[2] * q(2) + p[1] * p[1] * q(3) +
               2 * p[1] * p[2] * q(4) + p[2] * p[2] * q(5) + 2 * (p[0] * q(6) + p[1] * q(7) + p[2] * q(8)) + q(9);
      };
      const auto is_at = [&](const CollapsePoint& p) {
        return placed.at[0] == p.at[0] && placed.at[1] == p.at[1] && placed.at[2] == p.at[2];
      };
      EXPECT_NEAR(placed.cost, cost(placed.at), 1e-8);
      for (const double x : placed.at) EXPECT_EQ(x, std::round(x));
      // The end with the stronger constraint stays; edges between two locked points are not tested.
      if (a.held >= kLocked || (b.held < kLocked && a.held > b.held)) {
        EXPECT_TRUE(is_at(a));
        EXPECT_EQ(placed.along, 0.0);
      } else if (b.held > a.held) {
        EXPECT_TRUE(is_at(b));
        EXPECT_EQ(placed.along, 1.0);
      } else {
        EXPECT_LE(placed.cost, cost(a.at) + 1e-8);
        EXPECT_LE(placed.cost, cost(b.at) + 1e-8);
        if (task.rules.ends_only) {
          EXPECT_TRUE(is_at(a) || is_at(b));
        }
      }
    }
  }
}

#if defined(__x86_64__)

TEST(LodKernels, GiveTheSameBitsOnEveryProcessor) {
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "no AVX2";
  Random random(10);
  const Surface s = random_triangles(64, 11);
  std::vector<TriangleBlock> blocks(5);
  for (TriangleBlock& block : blocks)
    for (int axis = 0; axis < 3; ++axis)
      for (int lane = 0; lane < 4; ++lane) {
        block.a[axis][lane] = random.uniform(-9, 9);
        block.ab[axis][lane] = random.uniform(-9, 9), block.ac[axis][lane] = random.uniform(-9, 9);
      }
  for (int repeat = 0; repeat < 200; ++repeat) {
    PlacementTask edges(random), same_edges = edges;
    edges.run(place_edges), same_edges.run(avx2::place_edges);
    EXPECT_EQ(std::memcmp(edges.placed.data(), same_edges.placed.data(), sizeof edges.placed), 0);

    const std::array<DVec3, 3> points{random_point(random), random_point(random), random_point(random)};
    std::array<std::array<double, 20>, 3> far{}, same_far{};
    const auto rows = [](auto& of) { return std::array<double*, 3>{of[0].data(), of[1].data(), of[2].data()}; };
    triangle_distances(&points[0].x, points.size(), blocks.data(), blocks.size(), rows(far).data());
    avx2::triangle_distances(&points[0].x, points.size(), blocks.data(), blocks.size(), rows(same_far).data());
    EXPECT_EQ(std::memcmp(far.data(), same_far.data(), sizeof far), 0);
    const NearestTriangle nearest = nearest_triangle(far[0].data(), far[1].data(), far[2].data(), blocks.size());
    const NearestTriangle same_nearest =
        avx2::nearest_triangle(far[0].data(), far[1].data(), far[2].data(), blocks.size());
    EXPECT_EQ(std::memcmp(&nearest, &same_nearest, sizeof nearest), 0);

    const auto lay = [&](OverlayKernel kernel, std::vector<OverlayPiece>& pieces) {
      std::vector<OverlayPoint> projected(s.points.size());
      std::vector<uint32_t> outside(s.points.size()), stamps(s.points.size()), corners(s.points.size());
      for (uint32_t i = 0; i < corners.size(); ++i) corners[i] = i;
      Random slopes(static_cast<uint32_t>(repeat));
      OverlayTask task{};
      task.points = &s.points[0].x, task.corners = corners.data(), task.projected = projected.data();
      task.outside = outside.data(), task.stamps = stamps.data(), task.stamp = 1;
      for (OverlayPoint* slope : {&task.from_x, &task.from_y, &task.from_z}) {
        slope->l1 = 0.01 * slopes.uniform(-1, 1), slope->l2 = 0.01 * slopes.uniform(-1, 1);
        slope->l0 = -(slope->l1 + slope->l2), slope->height = slopes.uniform(-1, 1);
      }
      double covered = 0.0;
      const std::vector<uint32_t> all = s.all();
      pieces.resize(all.size());
      pieces.resize(kernel(task, all.data(), static_cast<uint32_t>(all.size()), pieces.data(), &covered));
      return covered;
    };
    std::vector<OverlayPiece> pieces, same_pieces;
    EXPECT_EQ(lay(overlay_kernel, pieces), lay(avx2::overlay_kernel, same_pieces));
    ASSERT_EQ(pieces.size(), same_pieces.size());
    for (size_t i = 0; i < pieces.size(); ++i) {
      EXPECT_EQ(pieces[i].triangle, same_pieces[i].triangle);
      EXPECT_EQ(pieces[i].distance, same_pieces[i].distance);
      EXPECT_EQ(pieces[i].inner_sides, same_pieces[i].inner_sides);
    }
  }
}

#endif

} // namespace
} // namespace packtrace::test
