// Tests the image of a source surface on the simplified one, and which degenerate triangles count as surface.

#include <algorithm>
#include <cmath>
#include <tuple>

#include <gtest/gtest.h>

#include "compress/bake/lod/bound/image_cover.h"
#include "compress/bake/lod/bound/line_cover.h"
#include "compress/bake/lod/bound/surface_bound.h"
#include "compress/bake/lod/bound/surface_walk.h"
#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/lod/bound/triangle_images.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

/// A bumpy square, simplified to a share of its triangles.
struct Simplified {
  /// @param steepness height factor of the bumps
  /// @param ragged whether the border is irregular and may move
  explicit Simplified(double kept, double steepness = 1.0, bool ragged = false) {
    constexpr uint32_t kCells = 14;
    Random random(5);
    for (uint32_t y = 0; y <= kCells; ++y)
      for (uint32_t x = 0; x <= kCells; ++x) {
        const bool on_border = x == 0 || y == 0 || x == kCells || y == kCells;
        mesh.points.emplace_back(100.0 * x, 100.0 * y, std::round(steepness * random.uniform(-40, 40)));
        if (ragged && on_border)
          for (const int axis : {0, 1}) mesh.points.back()[axis] += std::round(random.uniform(-30, 30));
        mesh.locked.push_back(on_border && !ragged);
      }
    for (uint32_t y = 0; y < kCells; ++y)
      for (uint32_t x = 0; x < kCells; ++x) {
        const uint32_t a = y * (kCells + 1) + x, b = a + kCells + 1;
        mesh.triangles.push_back({Triangle(a, a + 1, b + 1), Triangle(Wedge::kNone), 0, 0.0});
        mesh.triangles.push_back({Triangle(a, b + 1, b), Triangle(Wedge::kNone), 0, 0.0});
      }
    points = mesh.points, triangles = mesh.triangles;
    const std::vector<uint32_t> seams{0};
    simplify(mesh, {static_cast<uint32_t>(kept * static_cast<double>(triangles.size())), seams, false});
  }

  std::vector<DVec3> points; ///< of the source surface
  std::vector<LodTriangle> triangles;
  SimplifyMesh mesh;
};

class TriangleImagesOf : public testing::TestWithParam<double> {
protected:
  TriangleImagesOf() { after_.link(); }

  struct OutlinePoint {
    uint32_t simplified; ///< a triangle that the outline meets there
    DVec3 at;
  };
  /// Corners and crossings of a triangle's image.
  std::vector<OutlinePoint> outline_of(uint32_t t) {
    const Triangle& p = s_.triangles[t].points;
    std::vector<OutlinePoint> outline;
    uint32_t starts[3], ends[3];
    for (int i = 0; i < 3; ++i) {
      const uint32_t a = p[i], b = p[(i + 1) % 3];
      const SurfaceWalk::EdgePath& way = walk_.way(s_.mesh.side_edges[3 * size_t{t} + static_cast<size_t>(i)], a, b);
      const bool along = way.state == SurfaceWalk::EdgePath::State::kAlong;
      std::vector<uint32_t> met{along && a > b ? way.right : way.start}, crossings;
      for (uint32_t k = way.first; !along && k < way.first + way.count; ++k)
        crossings.push_back(k), met.push_back(walk_.into(k));
      if (a > b) std::reverse(met.begin(), met.end()), std::reverse(crossings.begin(), crossings.end());
      starts[i] = met.front(), ends[i] = met.back();
      outline.push_back({met[0], walk_.place(a).at});
      for (size_t k = 0; k < crossings.size(); ++k)
        for (const uint32_t side : {met[k], met[k + 1]})
          outline.push_back({side, walk_.crossing(crossings[k]).point()});
      outline.push_back({ends[i], walk_.place(b).at});
    }
    for (int i = 0; i < 3; ++i) { // turns around corners
      const SurfaceWalk::Place& place = walk_.place(p[i]);
      if (place.state != SurfaceWalk::Place::State::kPoint) continue;
      for (uint32_t last = ends[(i + 2) % 3]; last != starts[i];)
        outline.push_back({last = walk_.across(last, place.number), place.at});
    }
    return outline;
  }

  /// Checks points between those of an image's outline in the same simplified triangle, and the image's inner point.
  void expect_near_source(uint32_t t, const TriangleImages::Image& image,
                          const std::vector<TriangleImages::Piece>& pieces) {
    const std::vector<OutlinePoint> outline = outline_of(t);
    for (const TriangleImages::Piece& piece : pieces) {
      double back = 0.0;
      for (const TriangleImages::Piece& other : pieces)
        if (other.simplified == piece.simplified) back = std::max(back, other.back);
      std::vector<DVec3> inside;
      if (image.point != TriangleImages::kNone) inside.push_back(walk_.point(image.point));
      for (const OutlinePoint& point : outline)
        if (point.simplified == piece.simplified) inside.push_back(point.at);
      for (size_t i = 0; i < inside.size(); ++i)
        for (size_t k = i; k < inside.size(); ++k)
          for (size_t m = k; m < inside.size(); ++m, ++between_)
            EXPECT_LE(walk_.source().distance((inside[i] + inside[k] + inside[m]) / 3.0, t), back + 1e-9)
                << "triangle " << t;
    }
  }

  size_t between_ = 0; ///< points checked
  const Simplified s_{GetParam()};
  SurfaceSide after_{{s_.mesh.points, s_.mesh.triangles}};
  SurfaceWalk walk_{{s_.points, s_.triangles}, after_, s_.mesh};
  TriangleImages images_{walk_, s_.mesh};
};

TEST_P(TriangleImagesOf, BoundsTheDistanceOfEveryTriangle) {
  size_t mapped = 0;
  for (uint32_t t = 0; t < s_.triangles.size(); ++t) {
    TriangleImages::Image image{};
    if (!images_.find(t, image)) continue;
    ++mapped;
    std::vector<TriangleImages::Piece> pieces;
    images_.look_closer(t, image, pieces);
    ASSERT_FALSE(pieces.empty());
    double closer = 0.0, back = 0.0;
    for (const TriangleImages::Piece& piece : pieces)
      closer = std::max(closer, piece.there), back = std::max(back, piece.back);
    EXPECT_LE(closer, image.distance);
    EXPECT_LE(back, image.distance);
    expect_near_source(t, image, pieces);
    EXPECT_LE(image.inside, image.distance);
    const Triangle& p = s_.triangles[t].points;
    for (int i = 0; i <= 8; ++i)
      for (int k = 0; i + k <= 8; ++k) {
        const DVec3 at = (static_cast<double>(i) * s_.points[p.x] + static_cast<double>(k) * s_.points[p.y] +
                          static_cast<double>(8 - i - k) * s_.points[p.z]) /
                         8.0;
        double beyond = 1e300; // the distance from a piece's triangle less its bound
        for (const TriangleImages::Piece& piece : pieces)
          beyond = std::min(beyond, after_.surface().distance(at, piece.simplified) - piece.there);
        EXPECT_LE(beyond, 1e-9) << "triangle " << t;
      }
  }
  EXPECT_GT(mapped, s_.triangles.size() / 2);
  EXPECT_GT(between_, mapped);
}

TEST_P(TriangleImagesOf, CoverTrianglesAfterOnceAwayFromBorders) {
  std::vector<double> shares(s_.mesh.triangles.size());
  const std::vector<uint8_t> all(shares.size(), 1);
  std::vector<uint8_t> mapped(s_.triangles.size());
  std::vector<TriangleImages::Image> images(s_.triangles.size());
  for (uint32_t t = 0; t < s_.triangles.size(); ++t) {
    mapped[t] = t % 40 != 0 && images_.find(t, images[t]); // some are left out on purpose
    if (mapped[t] != 0) images_.add_shares(t, images[t], all, shares);
  }
  ImageCover cover(walk_, images_, s_.mesh);
  cover.begin(mapped);
  for (uint32_t t = 0; t < s_.triangles.size(); ++t)
    if (mapped[t] != 0) cover.add(t, images[t]);
  size_t whole = 0, other = 0;
  for (uint32_t s = 0; s < shares.size(); ++s) {
    if (cover.whole(s)) {
      EXPECT_NEAR(shares[s], 1.0, 1e-9) << "triangle " << s;
      ++whole;
    } else if (std::abs(shares[s] - 1.0) > 1e-9) {
      ++other;
    }
  }
  EXPECT_GT(whole, shares.size() / 4);
  EXPECT_GT(other, 0u);
  EXPECT_LT(whole, shares.size());
}

TEST(SurfaceWalk, PlacesPointsOfSteepSurfacesAndConnectsThem) {
  const Simplified s(0.25, 12.0, true);
  SurfaceSide after{{s.mesh.points, s.mesh.triangles}};
  after.link();
  SurfaceWalk walk({s.points, s.triangles}, after, s.mesh);
  const auto facing = [&](uint32_t p) {
    DVec3 sum(0.0);
    for (const uint32_t t : after.around(s.mesh.stands_for[p])) sum += walk.area_normal(t);
    return sum;
  };
  size_t paths = 0, found = 0, around = 0;
  for (uint32_t p = 0; p < s.points.size(); ++p) EXPECT_NE(walk.place(p).state, SurfaceWalk::Place::State::kNowhere);
  for (uint32_t t = 0; t < s.triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const Triangle& p = s.triangles[t].points;
      const uint32_t a = std::min(p[i], p[(i + 1) % 3]), b = std::max(p[i], p[(i + 1) % 3]);
      const SurfaceWalk::EdgePath& way = walk.way(s.mesh.side_edges[3 * size_t{t} + static_cast<size_t>(i)], a, b);
      ++paths, found += way.state != SurfaceWalk::EdgePath::State::kNowhere;
      if (way.state != SurfaceWalk::EdgePath::State::kAcross) continue;
      // Only paths around points leave the plane of the edge and the normals before their last crossing.
      const DVec3 left = glm::normalize(glm::cross(facing(a) + facing(b), s.points[b] - s.points[a]));
      bool off_plane = false;
      double last = 0.0;
      for (uint32_t k = way.first; k < way.first + way.count; ++k) {
        off_plane |=
            k + 1 < way.first + way.count && std::abs(glm::dot(left, walk.crossing(k).point() - s.points[a])) > 1e-3;
        const SurfaceWalk::Crossing& c = walk.crossing(k);
        const uint32_t from = k == way.first ? way.start : walk.into(k - 1);
        for (const uint32_t side : {from, c.into}) EXPECT_LE(after.surface().distance(c.point(), side), 1e-9);
        EXPECT_GE(c.on, last);
        EXPECT_LE(c.on, 1.0);
        last = c.on;
        EXPECT_NEAR(c.distance2,
                    glm::dot(c.point() - s.points[a] - c.on * (s.points[b] - s.points[a]),
                             c.point() - s.points[a] - c.on * (s.points[b] - s.points[a])),
                    1e-6);
      }
      around += off_plane;
    }
  EXPECT_GT(around, 0u);
  EXPECT_GT(found, paths * 9 / 10) << found << " of " << paths;
}

INSTANTIATE_TEST_SUITE_P(Kept, TriangleImagesOf, testing::Values(0.9, 0.5, 0.25));

/// Sample points of a triangle, including its corners: the corners and centres of equal parts.
std::vector<DVec3> points_in(const DVec3& a, const DVec3& b, const DVec3& c, int parts) {
  std::vector<DVec3> points;
  for (int i = 0; i <= parts; ++i)
    for (int k = 0; i + k <= parts; ++k)
      points.push_back(
          (static_cast<double>(i) * a + static_cast<double>(k) * b + static_cast<double>(parts - i - k) * c) /
          static_cast<double>(parts));
  return points;
}

class SurfaceBoundOf : public testing::TestWithParam<std::tuple<double, double, bool>> {
protected:
  SurfaceBoundOf()
      : s_(std::get<1>(GetParam()), std::get<0>(GetParam()), std::get<2>(GetParam())),
        links_(bound_errors(s_.points, s_.triangles, s_.mesh)) {}

  static constexpr double kRounding = 1e-9;
  Simplified s_;
  const SurfaceLinks links_;
  const OverlaySurface before_{s_.points, s_.triangles}, after_{s_.mesh.points, s_.mesh.triangles};
};

TEST_P(SurfaceBoundOf, EveryTriangleBeforeIsWithinItsBoundOfThoseLinkedToIt) {
  std::vector<std::vector<uint32_t>> linked(s_.triangles.size());
  for (const SurfaceLink& link : links_.links) linked[link.source].push_back(link.simplified);
  for (uint32_t t = 0; t < linked.size(); ++t) {
    EXPECT_FALSE(linked[t].empty()) << "triangle " << t;
    for (const DVec3& at : points_in(before_.corner(t, 0), before_.corner(t, 1), before_.corner(t, 2), 8)) {
      double least = 1e300;
      for (const uint32_t s : linked[t]) least = std::min(least, after_.distance(at, s));
      ASSERT_LE(least, links_.bounds[t] + kRounding) << "triangle " << t;
    }
  }
}

TEST_P(SurfaceBoundOf, EveryTriangleAfterIsWithinItsErrorOfThoseLinkedToIt) {
  const LinkLists linked = links_.by_simplified(s_.mesh.triangles.size());
  for (uint32_t s = 0; s < s_.mesh.triangles.size(); ++s)
    for (const DVec3& at : points_in(after_.corner(s, 0), after_.corner(s, 1), after_.corner(s, 2), 24)) {
      double least = 1e300;
      for (uint32_t i = linked.ends[s]; i < linked.ends[s + 1]; ++i)
        least = std::min(least, before_.distance(at, linked.source[i]));
      ASSERT_LE(least, s_.mesh.triangles[s].error + kRounding) << "triangle " << s;
    }
}

INSTANTIATE_TEST_SUITE_P(SteepnessAndKept, SurfaceBoundOf,
                         testing::Combine(testing::Values(0.0, 1.0, 8.0, 40.0), testing::Values(0.6, 0.4, 0.2),
                                          testing::Bool()));

TEST(LineCover, HoldsSidesOfTrianglesOnly) {
  std::vector<QuantizedVertex> vertices;
  for (uint32_t i = 0; i < 6; ++i) vertices.push_back({i, 0, {}});
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 1, 1}, {2, 0, 2}, {0, 3, 3}, {3, 4, 3}, {1, 1, 1}, {5, 5, 5}};
  const LineCover cover(triangles, vertices, 6);
  EXPECT_TRUE(cover.holds({0, 1, 1}));
  EXPECT_TRUE(cover.holds({2, 0, 2}));
  EXPECT_TRUE(cover.holds({1, 1, 1}));
  EXPECT_FALSE(cover.holds({0, 3, 3})); // ends at a point outside all proper triangles
  EXPECT_FALSE(cover.holds({3, 4, 3})); // isolated
  EXPECT_FALSE(cover.holds({5, 5, 5}));
}

} // namespace
} // namespace packtrace::test
