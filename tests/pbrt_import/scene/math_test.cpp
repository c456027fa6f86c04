#include "pbrt_import/scene/math.h"

#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/flattening.h"

namespace packtrace {
namespace {

void expect_near(DVec3 a, DVec3 b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

const DAffine kSkew(DVec3(2, 0, 1), DVec3(-1, 3, 0), DVec3(0, 0.5, 4), DVec3(10, -20, 30));
const DAffine kMirror(DVec3(-1, 0, 0), DVec3(0, 2, 0), DVec3(0, 0, 3), DVec3(1, 1, 1));

TEST(Affine, ComposeAppliesTheRightFactorFirst) {
  const DVec3 p(0.3, -0.7, 1.1);
  expect_near(transform_point(compose(kSkew, kMirror), p), transform_point(kSkew, transform_point(kMirror, p)), 1e-12);
}

TEST(Affine, InverseUndoes) {
  const DVec3 p(0.3, -0.7, 1.1);
  for (const DAffine& map : {kSkew, kMirror})
    expect_near(transform_point(inverse(map), transform_point(map, p)), p, 1e-12);
}

TEST(Affine, NormalsStayPerpendicularAndOnTheirSide) {
  const DVec3 a(1, 0, 0.2), b(0.1, 1, -0.3), n = glm::cross(a, b), outwards = n * 0.5;
  for (const DAffine& map : {kSkew, kMirror}) {
    const DVec3 moved = normal_matrix(map) * n;
    EXPECT_NEAR(glm::dot(moved, transform_vector(map, a)), 0.0, 1e-12);
    EXPECT_NEAR(glm::dot(moved, transform_vector(map, b)), 0.0, 1e-12);
    EXPECT_GT(glm::dot(moved, transform_vector(map, outwards)), 0.0)
        << "the side a normal points to moves with the map";
  }
}

TEST(Affine, FlatteningMapsStillHaveANormalAcrossTheFlatDirection) {
  const DAffine flat(DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 0), DVec3(0));
  const DVec3 moved = normal_matrix(flat) * DVec3(0.2, 0.1, 1);
  expect_near(glm::normalize(moved), DVec3(0, 0, 1), 1e-12);
}

TEST(Affine, MirrorsSwapHandedness) {
  EXPECT_TRUE(swaps_handedness(kMirror));
  EXPECT_FALSE(swaps_handedness(kSkew));
}

TEST(LookAt, PutsTheTargetAheadAndUpAbove) {
  const DVec3 eye(3, 4, -9), target(1, 0, 2), up(0.1, 1, 0);
  const DAffine camera = *look_at(eye, target, up);
  const DAffine camera_from_world = inverse(camera);
  expect_near(transform_point(camera_from_world, target), DVec3(0, 0, glm::length(target - eye)), 1e-12);
  const DVec3 above = transform_vector(camera_from_world, up);
  EXPECT_NEAR(above.x, 0.0, 1e-12);
  EXPECT_GT(above.y, 0.0);
  EXPECT_GT(glm::determinant(glm::dmat3(camera)), 0.0);
}

TEST(LookAt, LeftHanded) { // if +z is forward and +y is up, +x is right
  const DAffine camera = *look_at(DVec3(0), DVec3(0, 0, 1), DVec3(0, 1, 0));
  expect_near(camera[0], DVec3(1, 0, 0), 0);
}

TEST(LookAt, DirectionsThatDoNotDetermineAFrameAreRefused) {
  EXPECT_FALSE(look_at(DVec3(1), DVec3(1), DVec3(0, 1, 0)));
  EXPECT_FALSE(look_at(DVec3(0), DVec3(0, 5, 0), DVec3(0, 1, 0)));
  EXPECT_FALSE(look_at(DVec3(0), DVec3(0, 0, 1), DVec3(0)));
}

TEST(Bounds, EmptyStaysEmptyUnderTransforms) {
  const Bounds empty;
  EXPECT_TRUE(empty.empty());
  EXPECT_TRUE(transform_bounds(kSkew, empty).empty());
  EXPECT_EQ(empty.diagonal(), 0.0);
}

/// Components of maps and boxes, among them zeros and infinities.
double random_component(std::mt19937& random) {
  constexpr double kSpecial[] = {0.0, -0.0, 1.0, -1.0, 1e300, -1e300, std::numeric_limits<double>::infinity()};
  const size_t choice = random() % 20;
  return choice < std::size(kSpecial) ? kSpecial[choice] : std::uniform_real_distribution<double>(-100, 100)(random);
}

DAffine random_map(std::mt19937& random) {
  DAffine map;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) map[column][row] = random_component(random);
  return map;
}

TEST(Bounds, TransformedBoxIsThatOfTheEightCornersBitByBit) {
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    const DAffine map = random_map(random);
    const DVec3 a(random_component(random), random_component(random), random_component(random));
    const DVec3 b(random_component(random), random_component(random), random_component(random));
    const Bounds box{glm::min(a, b), glm::max(a, b)};
    Bounds corners;
    for (int corner = 0; corner < 8; ++corner)
      corners.extend(transform_point(map, DVec3(corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y,
                                                corner & 4 ? box.hi.z : box.lo.z)));
    const Bounds found = transform_bounds(map, box);
    ASSERT_EQ(std::memcmp(&found, &corners, sizeof found), 0) << i;
  }
}

TEST(Flattens, AgreesWithTheConditionNumber) {
  std::mt19937 random(2);
  const auto norm = [](const glm::dmat3& m) {
    return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
  };
  int flat = 0;
  for (int i = 0; i < 20000; ++i) {
    DAffine map = random_map(random);
    const double scale = std::ldexp(1.0, static_cast<int>(random() % 60) - 30);
    for (int row = 0; row < 3; ++row) map[0][row] = map[1][row] * 0.7 + map[2][row] * 0.2 + map[0][row] * scale;
    const glm::dmat3 linear(map), unit = linear / norm(linear);
    const bool expected = !(norm(unit) * norm(glm::inverse(unit)) < 0x1p22);
    ASSERT_EQ(flattens(map), expected) << i;
    flat += expected;
  }
  EXPECT_GT(flat, 2000);
  EXPECT_LT(flat, 18000);
}

TEST(Bounds, TransformedBoxHoldsTransformedPoints) {
  Bounds box;
  box.extend(DVec3(-1, 0, 2));
  box.extend(DVec3(3, 5, 7));
  const Bounds moved = transform_bounds(kSkew, box);
  for (int i = 0; i < 1000; ++i) {
    const DVec3 t((i % 10) / 9.0, (i / 10 % 10) / 9.0, (i / 100) / 9.0);
    const DVec3 p = transform_point(kSkew, box.lo + t * box.extent());
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(p, moved.lo - 1e-12)) &&
                glm::all(glm::lessThanEqual(p, moved.hi + 1e-12)));
  }
}

} // namespace
} // namespace packtrace
