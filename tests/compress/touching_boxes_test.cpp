#include "compress/bake/touching_boxes.h"

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

TEST(TouchingBoxes, CountsLikeComparingAllPairs) {
  test::Random random(3);
  for (const uint32_t count : {0u, 1u, 2u, 7u, 300u}) {
    std::vector<Bounds> boxes;
    std::vector<uint8_t> wanted;
    for (uint32_t i = 0; i < count; ++i) {
      const DVec3 at(random.uniform(0, 10), random.uniform(0, 10), random.uniform(0, 10));
      boxes.push_back(i % 11 == 5 ? Bounds{} : box(at, at + DVec3(random.uniform(0, 1))));
      wanted.push_back(i % 3 != 0);
    }
    uint64_t expected = 0;
    for (size_t i = 0; i < boxes.size(); ++i) {
      bool touches = false;
      for (size_t j = 0; j < boxes.size(); ++j)
        if (i != j && !boxes[i].empty() && !boxes[j].empty())
          touches |= glm::all(glm::lessThanEqual(boxes[i].lo, boxes[j].hi)) &&
                     glm::all(glm::lessThanEqual(boxes[j].lo, boxes[i].hi));
      expected += wanted[i] != 0 && touches;
    }
    EXPECT_EQ(count_touching(boxes, wanted), expected) << count;
    if (count == 300) {
      EXPECT_GT(expected, 20u);
      EXPECT_LT(expected, 180u);
    }
  }
}

TEST(TouchingBoxes, FacesThatMeetTouchAndEqualBoxesDo) {
  const std::vector<Bounds> boxes = {box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1}),
                                     box({2.001, 0, 0}, {3, 1, 1}), box({5, 5, 5}, {5, 5, 5}),
                                     box({5, 5, 5}, {5, 5, 5})};
  EXPECT_EQ(count_touching(boxes, std::vector<uint8_t>(5, 1)), 4u);
  EXPECT_EQ(count_touching(boxes, std::vector<uint8_t>{0, 1, 1, 0, 1}), 2u);
}

} // namespace
} // namespace packtrace
