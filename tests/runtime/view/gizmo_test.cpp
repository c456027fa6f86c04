#include "runtime/view/gizmo.h"

#include <gtest/gtest.h>

#include "tests/runtime/view/view_bench.h"

namespace packtrace {
namespace {

using test::ViewBench;

TEST(Gizmo, ItsLongestArrowIsASixthOfThePicture) {
  for (const ImageSize size : {ImageSize{960, 540}, ImageSize{100, 400}}) {
    const Gizmo gizmo = gizmo_at(DVec3(0, 1, 0), ViewBench::camera(), size).value();
    double longest_px = 0.0;
    for (const auto& tip : gizmo.tips) {
      ASSERT_TRUE(tip);
      longest_px = std::max(longest_px, glm::length((*tip - gizmo.centre) * glm::dvec2(size.width, size.height)));
    }
    const double side = std::min(size.width, size.height);
    EXPECT_NEAR(longest_px, side / 6.0, 0.02 * side);
  }
}

TEST(Gizmo, WhatIsBehindTheCameraHasNone) {
  EXPECT_FALSE(gizmo_at(DVec3(0, 2, -20), ViewBench::camera(), {64, 48}));
  EXPECT_FALSE(gizmo_at(DVec3(ViewBench::camera().world_from_camera[3]), ViewBench::camera(), {64, 48}));
}

TEST(Gizmo, AnArrowTowardsTheCameraCannotBeDragged) {
  const Camera along_x = test::camera_at(DVec3(-5, 0, 0), DVec3(0, 0, 0), 50.0);
  const ImageSize size{64, 48};
  const Gizmo gizmo = gizmo_at(DVec3(0), along_x, size).value();
  EXPECT_EQ(dragged_distance(gizmo, 0, {0.1, 0.1}, size), 0.0);
  EXPECT_NE(dragged_distance(gizmo, 1, {0.1, 0.1}, size), 0.0);
}

} // namespace
} // namespace packtrace
