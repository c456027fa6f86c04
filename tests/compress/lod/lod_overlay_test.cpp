// Tests overlays of triangles on surfaces, which bound their distance.

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/lod/bound/triangle_overlay.h"
#include "tests/compress/lod/test_surfaces.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

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

TEST(Overlay, BoundsTrianglesThatStickOutOverBorders) {
  const Surface coarse = bumpy_square(7, 5.0f, 3), fine = bumpy_square(11, 5.0f, 4);
  Random random(12);
  Overlay overlay(coarse.view());
  size_t found = 0, beyond = 0; // triangles with an overlay; samples that only pieces beyond a border bound
  for (size_t repeat = 0; repeat < 20; ++repeat) {
    std::vector<uint32_t> some = coarse.all();
    std::erase_if(some, [&](uint32_t) { return random.uniform(0, 1) < 0.3f; });
    for (size_t t = 0; t < fine.triangles.size(); ++t) {
      const std::array<DVec3, 3> p = fine.corners(t);
      std::vector<OverlayPiece> pieces;
      if (overlay.overlay(p, DVec3(0, 0, 1), some, pieces) || !overlay.overlay_over_borders(pieces)) continue;
      ++found;
      double bound = 0.0, without = 0.0;
      for (const OverlayPiece& piece : pieces) {
        bound = std::max(bound, overlay.nearest_distance(piece));
        if (piece.inner_sides != OverlayPiece::kBeyondSide) without = bound;
      }
      for (int i = 0; i <= 10; ++i)
        for (int k = 0; k <= 10 - i; ++k) {
          const DVec3 q = p[0] + 0.1 * i * (p[1] - p[0]) + 0.1 * k * (p[2] - p[0]);
          double distance = 1e300;
          for (const OverlayPiece& piece : pieces)
            distance = std::min(distance, coarse.view().distance(q, piece.triangle));
          ASSERT_LE(distance, bound + 1e-9) << "triangle " << t;
          beyond += distance > without;
        }
    }
  }
  EXPECT_GT(found, 500u);
  EXPECT_GT(beyond, 500u);
}

TEST(Overlay, UsesOnlyPiecesThatAreNearEnough) {
  Surface layers = bumpy_square(7, 5.0f, 3);
  const auto near_count = static_cast<uint32_t>(layers.triangles.size());
  for (const LodTriangle& t : bumpy_square(7, 5.0f, 15).triangles) // a second layer, far above
    layers.triangles.push_back({t.points + static_cast<uint32_t>(layers.points.size()), t.wedges, 0, 0.0});
  for (DVec3 p : bumpy_square(7, 5.0f, 15).points) layers.points.emplace_back(p.x, p.y, p.z + 60.0);
  const Surface fine = bumpy_square(11, 5.0f, 4);
  Random random(16);
  Overlay overlay(layers.view());
  size_t found = 0, rejected = 0;
  for (size_t repeat = 0; repeat < 20; ++repeat) {
    std::vector<uint32_t> some = layers.all();
    std::erase_if(some, [&](uint32_t) { return random.uniform(0, 1) < 0.2f; });
    const double limit = random.uniform(3, 12);
    for (size_t t = 0; t < fine.triangles.size(); ++t) {
      const std::array<DVec3, 3> p = fine.corners(t);
      std::vector<OverlayPiece> pieces, near;
      overlay.overlay(p, DVec3(0, 0, 1), some, pieces);
      if (!overlay.overlay_near([&](uint32_t, double distance) { return distance <= limit; }, near)) {
        ++rejected;
        EXPECT_TRUE(near.empty());
        continue;
      }
      ++found;
      for (int i = 0; i <= 10; ++i)
        for (int k = 0; k <= 10 - i; ++k) {
          const DVec3 q = p[0] + 0.1 * i * (p[1] - p[0]) + 0.1 * k * (p[2] - p[0]);
          double distance = 1e300;
          for (const OverlayPiece& piece : near) {
            EXPECT_LT(piece.triangle, near_count);
            distance = std::min(distance, layers.view().distance(q, piece.triangle));
          }
          ASSERT_LE(distance, limit + 1e-9) << "triangle " << t;
        }
    }
  }
  EXPECT_GT(found, 500u);
  EXPECT_GT(rejected, 500u);
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

} // namespace
} // namespace packtrace::test
