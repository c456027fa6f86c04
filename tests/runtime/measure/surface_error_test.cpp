#include "runtime/measure/nearest_surface.h"

#include <random>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

TEST(NearestOnTriangle, FindsInteriorsEdgesAndCorners) {
  const DVec3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  EXPECT_DOUBLE_EQ(nearest_on_triangle({0.25, 0.25, 2.0}, a, b, c).distance, 2.0);
  EXPECT_DOUBLE_EQ(nearest_on_triangle({0.5, -3.0, 0.0}, a, b, c).distance, 3.0);
  EXPECT_DOUBLE_EQ(nearest_on_triangle({4.0, -4.0, 0.0}, a, b, c).distance, 5.0) << "corner b";
  const NearestPoint slope = nearest_on_triangle({1.0, 1.0, 0.0}, a, b, c);
  EXPECT_DOUBLE_EQ(slope.distance, std::sqrt(0.5));
  EXPECT_FLOAT_EQ(slope.barycentrics.x, 0.5f);
  EXPECT_FLOAT_EQ(slope.barycentrics.y, 0.5f);
}

TEST(NearestOnTriangle, DegenerateTrianglesAreSegmentsAndPoints) {
  const DVec3 a(0, 0, 0), b(2, 0, 0);
  EXPECT_DOUBLE_EQ(nearest_on_triangle({1, 1, 0}, a, b, {1, 0, 0}).distance, 1.0);
  EXPECT_DOUBLE_EQ(nearest_on_triangle({3, 4, 0}, a, a, a).distance, 5.0);
}

TEST(NearestSurface, AgreesWithTryingEveryTriangle) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0), small(-0.05, 0.05);
  std::vector<DVec3> positions;
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < 300; ++i) {
    const DVec3 centre(coordinate(random), coordinate(random), coordinate(random));
    for (int corner = 0; corner < 3; ++corner)
      positions.push_back(centre + DVec3(small(random), small(random), small(random)));
    triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  EmbreeDevice device;
  const NearestSurface surface(device, positions, triangles);
  for (int i = 0; i < 500; ++i) {
    const DVec3 p(coordinate(random), coordinate(random), coordinate(random));
    double least = std::numeric_limits<double>::infinity();
    for (const Triangle t : triangles)
      least = std::min(least, nearest_on_triangle(p, positions[t.x], positions[t.y], positions[t.z]).distance);
    EXPECT_EQ(surface.nearest(p).distance, least);
  }
  const DVec3 on = (positions[0] + positions[1] + positions[2]) / 3.0;
  EXPECT_LT(surface.nearest(on).distance, 1e-15) << "distances are computed in double";
}

} // namespace
} // namespace packtrace
