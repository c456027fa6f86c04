// Where simplify() moved a surface: its image on the new one, and what counts as surface.

#include <algorithm>

#include <gtest/gtest.h>

#include "compress/bake/lod/line_cover.h"
#include "compress/bake/lod/surface_bound.h"
#include "compress/bake/lod/surface_walk.h"
#include "compress/bake/lod/triangle_distance.h"
#include "compress/bake/lod/triangle_images.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

/// A bumpy square with a locked border, simplified to a part of its triangles.
struct Simplified {
  /// @param steepness of the bumps
  explicit Simplified(double kept, double steepness = 1.0) {
    constexpr uint32_t kCells = 14;
    Random random(5);
    for (uint32_t y = 0; y <= kCells; ++y)
      for (uint32_t x = 0; x <= kCells; ++x) {
        mesh.points.emplace_back(100.0 * x, 100.0 * y, std::round(steepness * random.uniform(-40, 40)));
        mesh.locked.push_back(x == 0 || y == 0 || x == kCells || y == kCells);
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

  std::vector<DVec3> points; ///< before
  std::vector<LodTriangle> triangles;
  SimplifyMesh mesh;
};

class TriangleImagesOf : public testing::TestWithParam<double> {
protected:
  TriangleImagesOf() { after_.link(); }

  /// The distance of a point from all of the surface after.
  double distance(const DVec3& p) const {
    double least = 1e300;
    for (uint32_t s = 0; s < s_.mesh.triangles.size(); ++s) least = std::min(least, after_.surface().distance(p, s));
    return least;
  }

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
    std::vector<OverlayPiece> pieces;
    images_.look_closer(t, image, pieces);
    ASSERT_FALSE(pieces.empty());
    double closer = 0.0;
    for (const OverlayPiece& piece : pieces) closer = std::max(closer, piece.distance);
    EXPECT_LE(closer, image.distance);
    EXPECT_LE(image.inside, image.distance);
    const Triangle& p = s_.triangles[t].points;
    for (int i = 0; i <= 8; ++i)
      for (int k = 0; i + k <= 8; ++k) {
        const DVec3 at = (static_cast<double>(i) * s_.points[p.x] + static_cast<double>(k) * s_.points[p.y] +
                          static_cast<double>(8 - i - k) * s_.points[p.z]) /
                         8.0;
        EXPECT_LE(distance(at), closer + 1e-9) << "triangle " << t;
      }
  }
  EXPECT_GT(mapped, s_.triangles.size() / 2);
}

TEST_P(TriangleImagesOf, CoverTrianglesAfterOnceAwayFromBorders) {
  std::vector<double> shares(s_.mesh.triangles.size());
  const std::vector<uint8_t> none_known(shares.size());
  std::vector<uint8_t> mapped(s_.triangles.size()), covered(s_.mesh.triangles.size());
  for (uint32_t t = 0; t < s_.triangles.size(); ++t) {
    TriangleImages::Image image{};
    mapped[t] = t % 40 != 0 && images_.find(t, image); // some are left out
    if (mapped[t] == 0) continue;
    images_.add_shares(t, image, none_known, shares);
    const OverlaySurface before{s_.points, s_.triangles};
    for (const uint32_t s : images_.met(image))
      covered[s] |=
          glm::dot(before.area_normal(t), walk_.area_normal(s)) > 0.0 ? TriangleImages::kFront : TriangleImages::kBack;
  }
  images_.find_covered(mapped, covered);
  size_t whole = 0;
  for (size_t s = 0; s < shares.size(); ++s) {
    EXPECT_FALSE((covered[s] & TriangleImages::kWhole) != 0 && (covered[s] & TriangleImages::kCrossed) != 0);
    if ((covered[s] & TriangleImages::kWhole) == 0) continue;
    EXPECT_NEAR(shares[s], 1.0, 1e-9) << "triangle " << s;
    ++whole;
  }
  EXPECT_GT(whole, shares.size() / 4);
  EXPECT_LT(whole, shares.size());
}

INSTANTIATE_TEST_SUITE_P(Kept, TriangleImagesOf, testing::Values(0.9, 0.5, 0.25));

TEST(SurfaceBound, EveryTriangleBeforeIsWithinItsBound) {
  for (const double steepness : {1.0, 8.0, 40.0})
    for (const double kept : {0.6, 0.4, 0.2}) {
      Simplified s(kept, steepness);
      const SurfaceLinks links = bound_errors(s.points, s.triangles, s.mesh);
      std::vector<uint8_t> linked(s.triangles.size());
      for (const SurfaceLink& link : links.links) linked[link.before] = 1;
      const OverlaySurface after{s.mesh.points, s.mesh.triangles};
      for (uint32_t t = 0; t < s.triangles.size(); ++t) {
        EXPECT_TRUE(linked[t]) << "triangle " << t;
        const Triangle& p = s.triangles[t].points;
        for (const DVec3& at :
             {s.points[p.x], s.points[p.y], s.points[p.z], (s.points[p.x] + s.points[p.y] + s.points[p.z]) / 3.0}) {
          double least = 1e300;
          for (uint32_t k = 0; k < s.mesh.triangles.size(); ++k) least = std::min(least, after.distance(at, k));
          EXPECT_LE(least, links.bounds[t] + 1e-9) << "triangle " << t << ", " << steepness << ", " << kept;
        }
      }
    }
}

TEST(LineCover, HoldsSidesOfTrianglesOnly) {
  std::vector<QuantizedVertex> vertices;
  for (uint32_t i = 0; i < 6; ++i) vertices.push_back({i, 0, {}});
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 1, 1}, {2, 0, 2}, {0, 3, 3}, {3, 4, 3}, {1, 1, 1}, {5, 5, 5}};
  const LineCover cover(triangles, vertices, 6);
  EXPECT_TRUE(cover.holds({0, 1, 1}));
  EXPECT_TRUE(cover.holds({2, 0, 2}));
  EXPECT_TRUE(cover.holds({1, 1, 1}));
  EXPECT_FALSE(cover.holds({0, 3, 3})); // to a point away from it
  EXPECT_FALSE(cover.holds({3, 4, 3})); // alone
  EXPECT_FALSE(cover.holds({5, 5, 5}));
}

} // namespace
} // namespace packtrace::test
