// Tests the kernels that measure and place four triangles or edges at once.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/lod/bound/triangle_overlay.h"
#include "compress/bake/lod/bound/triangle_refiner.h"
#include "compress/bake/lod/bound/triangle_set.h"
#include "compress/bake/lod/simplify/edge_placement.h"
#include "compress/bake/lod/simplify/edge_queue.h"
#include "compress/bake/lod/simplify/triangle_planes.h"
#include "pbrt_import/base/cpu.h"
#include "tests/compress/lod/test_surfaces.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

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

/// Takes all edges, as the simplifier does.
std::vector<uint32_t> drain(EdgeQueue& queue, const std::vector<float>& costs) {
  std::vector<uint32_t> order, opened;
  for (;;) {
    for (; !queue.heap_empty(); queue.pop()) order.push_back(queue.top());
    opened.clear();
    if (!queue.open_next(opened)) return order;
    for (const uint32_t edge : opened) queue.add(costs[edge], edge);
  }
}

TEST(EdgeQueue, GivesEdgesByCostThenNumber) {
  Random random(8);
  EdgeQueue queue;
  std::vector<float> costs;
  std::vector<uint32_t> expected;
  for (uint32_t i = 0; i < 1000; ++i) {
    costs.push_back(std::floor(random.uniform(0, 100)) * (i % 50 == 0 ? 1e-42f : 1e10f));
    expected.push_back(i);
  }
  costs.back() = std::numeric_limits<float>::max();
  std::sort(expected.begin(), expected.end(),
            [&](uint32_t a, uint32_t b) { return std::pair(costs[a], a) < std::pair(costs[b], b); });
  for (int use = 0; use < 2; ++use) { // the second time, it is not new
    queue.reset(costs.size());
    for (uint32_t i = 0; i < costs.size(); ++i) queue.add(i + 1 == costs.size() ? 1e300 : costs[i], i);
    EXPECT_EQ(drain(queue, costs), expected);
  }
}

TEST(EdgeQueue, TakesAnyCost) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> costs = {-nan, kInfinite, 1.0, -0.0, nan, -kInfinite, -1.0, 0.0};
  EdgeQueue queue;
  queue.reset(costs.size());
  for (uint32_t i = 0; i < costs.size(); ++i) queue.add(costs[i], i);
  std::vector<uint32_t> order, opened;
  while (queue.open_next(opened)) {
    for (const uint32_t edge : opened) queue.add(costs[edge], edge);
    for (; !queue.heap_empty(); queue.pop()) order.push_back(queue.top());
    opened.clear();
  }
  EXPECT_EQ(order, (std::vector<uint32_t>{3, 5, 6, 7, 2, 0, 1, 4})); // 0 and below, 1, infinity and NaN
}

TEST(EdgeQueue, OrdersEdgesWhoseCostsChange) {
  std::vector<float> costs(40);
  EdgeQueue queue;
  queue.reset(costs.size());
  for (uint32_t i = 0; i < costs.size(); ++i) queue.add(costs[i] = static_cast<float>(i), i);
  std::vector<uint32_t> opened;
  while (queue.heap_empty() && queue.open_next(opened))
    if (opened.size() >= 20) // all up to 19, at least; some costs go up, some go below what is open
      for (const uint32_t edge : opened)
        queue.add(costs[edge] = edge % 2 == 0 ? 20.5f + static_cast<float>(edge) : 0.25f, edge);
  const std::vector<uint32_t> order = drain(queue, costs);
  ASSERT_EQ(order.size(), costs.size());
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return costs[a] < costs[b]; }));
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

/// What add_triangle_planes() and its variants compute for a surface.
struct PlaneSums {
  explicit PlaneSums(const Surface& s)
      : surface(s), normals(s.triangles.size()), sums(s.points.size()), fans(s.points.size()) {}
  uint64_t run(PlaneKernel kernel, uint64_t first) {
    return kernel({&surface.points[0].x, reinterpret_cast<const char*>(&surface.triangles[0].points),
                   sizeof(LodTriangle), &normals[0].x, sums.data(), fans.data()},
                  first, normals.size());
  }
  const Surface& surface;
  std::vector<DVec3> normals;
  std::vector<CollapsePoint> sums;
  std::vector<PointFan> fans;
};

TEST(TrianglePlanes, AnglesAroundAPointAddUpAndStopAtTrianglesWithoutArea) {
  Surface s = bumpy_square(6, 0.0f, 13);
  s.triangles.insert(s.triangles.begin() + 30, {Triangle(0, 1, 2), Triangle(Wedge::kNone), 0, 0.0}); // on one line
  PlaneSums planes(s);
  EXPECT_EQ(planes.run(add_triangle_planes, 0), 30u);
  EXPECT_EQ(planes.run(add_triangle_planes, 31), s.triangles.size());
  const size_t inner = 3 * 7 + 3, rim = 3;
  EXPECT_NEAR(planes.fans[inner].angle, 2.0 * M_PI, 0.1); // the arcsine is 1 % off
  EXPECT_NEAR(planes.fans[rim].angle, M_PI, 0.05);
  EXPECT_NEAR(glm::length(DVec3(planes.fans[inner].directions[0], planes.fans[inner].directions[1], 0)), 0.0, 1e-9);
  EXPECT_NEAR(planes.fans[rim].directions[1], 2.0, 1e-9); // integral of the sine from 0 to pi
  const double cell = (100.0 / 6) * (100.0 / 6);
  EXPECT_NEAR(planes.sums[inner].area, 6 * cell, 1e-9);       // six triangles of half a cell; twice their area
  EXPECT_NEAR(planes.sums[inner].quadric[5], 6 * cell, 1e-9); // zz: all normals are (0, 0, 1)
  EXPECT_NEAR(planes.sums[inner].quadric[0], 0.0, 1e-9);
}

#if defined(__x86_64__)

TEST(LodKernels, AddTheSamePlanesOnEveryProcessor) {
  if (!cpu_has_avx2()) GTEST_SKIP() << "no AVX2";
  const Surface s = random_triangles(63, 14);
  PlaneSums planes(s), same(s);
  for (uint64_t at = 0; at < s.triangles.size(); ++at) {
    const uint64_t next = planes.run(add_triangle_planes, at);
    EXPECT_EQ(same.run(avx2::add_triangle_planes, at), next);
    at = next;
  }
  EXPECT_EQ(std::memcmp(planes.normals.data(), same.normals.data(), sizeof(DVec3) * s.triangles.size()), 0);
  EXPECT_EQ(std::memcmp(planes.sums.data(), same.sums.data(), sizeof(CollapsePoint) * s.points.size()), 0);
  EXPECT_EQ(std::memcmp(planes.fans.data(), same.fans.data(), sizeof(PointFan) * s.points.size()), 0);
}

TEST(LodKernels, GiveTheSameBitsOnEveryProcessor) {
  if (!cpu_has_avx2()) GTEST_SKIP() << "no AVX2";
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

    const auto run_overlay = [&](OverlayKernel kernel, std::vector<OverlayPiece>& pieces) {
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
      OverlayCover cover{};
      const std::vector<uint32_t> all = s.all();
      pieces.resize(all.size());
      pieces.resize(kernel(task, all.data(), static_cast<uint32_t>(all.size()), pieces.data(), &cover));
      return cover;
    };
    std::vector<OverlayPiece> pieces, same_pieces;
    const OverlayCover cover = run_overlay(overlay_kernel, pieces),
                       same_cover = run_overlay(avx2::overlay_kernel, same_pieces);
    EXPECT_EQ(cover.count, same_cover.count);
    EXPECT_EQ(cover.largest, same_cover.largest);
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
