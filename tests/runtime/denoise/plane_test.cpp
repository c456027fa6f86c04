#include "runtime/denoise/plane.h"

#include <gtest/gtest.h>

namespace packtrace {
namespace {

TEST(Plane, RoomHasABorderOfZeros) {
  Plane<float> plane;
  for (const ImageSize size : {ImageSize{5, 3}, ImageSize{1, 1}, ImageSize{3, 5}}) {
    { // dirties memory that the plane may get
      Plane<float> dirty;
      dirty.resize({5, 5});
      for (int y = -kPlaneBorder; y < 5 + kPlaneBorder; ++y)
        std::fill_n(dirty.row(y) - kPlaneBorder, 5 + 2 * kPlaneBorder, 7.0f);
    }
    plane.make_room(size);
    const int width = static_cast<int>(size.width), height = static_cast<int>(size.height);
    ASSERT_EQ(plane.bytes(), sizeof(float) * (size.width + 16) * (size.height + 16));
    for (int y = -kPlaneBorder; y < height + kPlaneBorder; ++y)
      for (int x = -kPlaneBorder; x < width + kPlaneBorder; ++x) {
        const bool inside = x >= 0 && y >= 0 && x < width && y < height;
        EXPECT_TRUE(inside || plane.row(y)[x] == 0.0f) << x << ' ' << y;
      }
    plane.row(0)[0] = 3.0f;
    plane.make_room(size);
    EXPECT_EQ(plane.row(0)[0], 3.0f) << "a plane of this size is left alone";
  }
  plane.free();
  EXPECT_EQ(plane.bytes(), 0u);
}

} // namespace
} // namespace packtrace
