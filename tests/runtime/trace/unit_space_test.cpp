#include "runtime/trace/unit_space.h"

#include <gtest/gtest.h>

namespace packtrace {
namespace {

Bounds box(DVec3 lo, DVec3 hi) {
  Bounds bounds;
  bounds.extend(lo);
  bounds.extend(hi);
  return bounds;
}

/// Converts a point to float coordinates in the space and back.
DVec3 through_floats(const UnitSpace& space, DVec3 p) { return space.from_unit(DVec3(Vec3(space.to_unit(p)))); }

TEST(UnitSpace, CoordinatesStayWithinItsSize) {
  for (const double scale : {1e-30, 1.0, 1e30}) {
    const Bounds bounds = box(DVec3(-3, 100, 7) * scale, DVec3(5, 101, 7) * scale);
    const UnitSpace space(bounds);
    for (const DVec3 corner : {space.to_unit(bounds.lo), space.to_unit(bounds.hi)})
      for (int axis = 0; axis < 3; ++axis) EXPECT_LE(std::abs(corner[axis]), UnitSpace::kHalfSize);
  }
}

TEST(UnitSpace, SmallThingsNearTheOriginOfALargeSceneKeepEveryBit) {
  const UnitSpace space(box(DVec3(-1e3), DVec3(1e7, 5, 2e6)));
  for (const DVec3 p : {DVec3(Vec3(1e-6f, 3e-7f, -2e-6f)), DVec3(Vec3(1.0000001f, 0, 9.9999994e-7f))})
    EXPECT_EQ(through_floats(space, p), p);
}

TEST(UnitSpace, FarScenesMoveToTheOriginWithoutLoss) {
  const UnitSpace space(box(DVec3(1e7), DVec3(1e7 + 64)));
  EXPECT_GT(space.scale(), UnitSpace::kHalfSize / 128) << "the extent decides, not the distance";
  for (float x = 1e7f; x <= 1e7f + 64; x += 1) EXPECT_EQ(through_floats(space, DVec3(x)), DVec3(x));
}

TEST(UnitSpace, EmptyAndPointBoxesAreHarmless) {
  EXPECT_EQ(UnitSpace(Bounds()).to_unit(DVec3(3)), DVec3(3));
  EXPECT_EQ(through_floats(UnitSpace(box(DVec3(0), DVec3(0))), DVec3(0)), DVec3(0));
  EXPECT_EQ(through_floats(UnitSpace(box(DVec3(5), DVec3(5))), DVec3(5)), DVec3(5));
}

} // namespace
} // namespace packtrace
