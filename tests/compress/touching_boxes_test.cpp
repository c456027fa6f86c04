#include "compress/bake/grid/touching_boxes.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

Bounds box(DVec3 lo, DVec3 hi) {
  Bounds bounds;
  bounds.lo = lo, bounds.hi = hi;
  return bounds;
}

constexpr double kNone = std::numeric_limits<double>::infinity();

TEST(TouchingBoxes, TheSmallestIsThatOfAllPairs) {
  test::Random random(3);
  for (const uint32_t count : {0u, 1u, 2u, 7u, 300u}) {
    std::vector<Bounds> boxes;
    std::vector<double> sizes;
    std::vector<uint32_t> asked;
    for (uint32_t i = 0; i < count; ++i) {
      const DVec3 at(random.uniform(0, 10), random.uniform(0, 10), random.uniform(0, 10));
      boxes.push_back(i % 11 == 5 ? Bounds{} : box(at, at + DVec3(random.uniform(0, 1))));
      sizes.push_back(random.uniform(-5, 5));
      if (i % 3 != 0) asked.push_back(i);
    }
    const std::vector<double> smallest = smallest_touching(boxes, sizes, asked);
    ASSERT_EQ(smallest.size(), asked.size());
    uint32_t touching = 0;
    for (size_t k = 0; k < asked.size(); ++k) {
      const size_t i = asked[k];
      double expected = kNone;
      for (size_t j = 0; j < boxes.size(); ++j)
        if (i != j && !boxes[i].empty() && !boxes[j].empty() &&
            glm::all(glm::lessThanEqual(boxes[i].lo, boxes[j].hi)) &&
            glm::all(glm::lessThanEqual(boxes[j].lo, boxes[i].hi)))
          expected = std::min(expected, sizes[j]);
      EXPECT_EQ(smallest[k], expected);
      touching += expected != kNone;
    }
    if (count == 300) {
      EXPECT_GT(touching, 20u);
      EXPECT_LT(touching, 180u);
    }
  }
}

TEST(TouchingBoxes, FacesThatMeetTouchAndEqualBoxesDo) {
  const std::vector<Bounds> boxes = {box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1}),
                                     box({2.001, 0, 0}, {3, 1, 1}), box({5, 5, 5}, {5, 5, 5}),
                                     box({5, 5, 5}, {5, 5, 5})};
  EXPECT_EQ(smallest_touching(boxes, std::vector<double>{1, 2, 3, 4, 5}, std::vector<uint32_t>{0, 1, 2, 3, 4}),
            (std::vector<double>{2, 1, kNone, 5, 4}));
}

} // namespace
} // namespace packtrace
