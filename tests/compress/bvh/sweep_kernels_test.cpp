#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/trees/sweep_kernels.h"
#include "tests/compress/bvh/kernel_sets.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using sweep_kernels::Box;
using sweep_kernels::Split;
using test::kernel_sets;

/// Boxes with corners below `limit`; of a small limit many splits cost the same.
std::vector<Box> random_sweep_boxes(uint32_t count, uint32_t limit, test::Random& random) {
  std::vector<Box> boxes(count);
  for (Box& box : boxes) {
    box = {};
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<float>(random.bits() % limit), b = static_cast<float>(random.bits() % limit);
      box.minus_lo[axis] = -std::min(a, b), box.hi[axis] = std::max(a, b);
    }
  }
  return boxes;
}

float half_area_of(std::span<const Box> boxes, std::span<const uint8_t> numbers) {
  std::array<float, 3> size;
  for (size_t axis = 0; axis < 3; ++axis) {
    float lo = std::numeric_limits<float>::infinity(), hi = 0.0f;
    for (const uint8_t i : numbers) lo = std::min(lo, -boxes[i].minus_lo[axis]), hi = std::max(hi, boxes[i].hi[axis]);
    size[axis] = hi - lo;
  }
  return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
}

/// Tries all splits of all orders one after another.
Split best_split(std::span<const Box> boxes, std::span<const std::vector<uint8_t>> orders) {
  const auto count = static_cast<uint32_t>(orders[0].size());
  Split best{half_area_of(boxes, orders[0]), 1, 0};
  float least = std::numeric_limits<float>::infinity();
  const auto off_middle = [&](uint32_t left) { return std::abs(int64_t{count} - 2 * int64_t{left}); };
  for (uint32_t axis = 0; axis < orders.size(); ++axis)
    for (uint32_t left = 1; left < count; ++left) {
      const auto all = std::span(orders[axis]);
      const float cost = half_area_of(boxes, all.first(left)) * static_cast<float>(left) +
                         half_area_of(boxes, all.subspan(left)) * static_cast<float>(count - left);
      if (cost < least || (cost == least && off_middle(left) < off_middle(best.left)))
        least = cost, best.left = left, best.axis = axis;
    }
  return best;
}

void expect_equal(const Split& split, const Split& wanted) {
  EXPECT_EQ(split.area, wanted.area);
  EXPECT_EQ(split.left, wanted.left);
  EXPECT_EQ(split.axis, wanted.axis);
}

TEST(SweepKernels, FindTheBestSplitOfARun) {
  test::Random random(1);
  for (uint32_t count = 2; count <= sweep_kernels::kMaxBoxes; ++count)
    for (const uint32_t limit : {1u, 3u, 1000u, 1u << 24}) {
      SCOPED_TRACE(std::to_string(count) + " boxes below " + std::to_string(limit));
      const std::vector<Box> boxes = random_sweep_boxes(count, limit, random);
      std::vector<uint8_t> order(count);
      std::iota(order.begin(), order.end(), uint8_t{0});
      const Split wanted = best_split(boxes, {&order, 1});
      for (const sweep_kernels::Kernels* kernels : kernel_sets(sweep_kernels::kPortable, sweep_kernels::kernels()))
        expect_equal(kernels->split_run(boxes.data(), count), wanted);
    }
}

TEST(SweepKernels, FindTheBestSplitOfThreeOrders) {
  test::Random random(2);
  for (uint32_t count = 2; count <= sweep_kernels::kMaxBoxes; ++count)
    for (const uint32_t limit : {1u, 3u, 1000u, 1u << 24}) {
      SCOPED_TRACE(std::to_string(count) + " boxes below " + std::to_string(limit));
      const std::vector<Box> boxes = random_sweep_boxes(sweep_kernels::kMaxBoxes, limit, random);
      std::array<std::vector<uint8_t>, 3> orders;
      for (std::vector<uint8_t>& order : orders) {
        order.resize(count);
        std::iota(order.begin(), order.end(), static_cast<uint8_t>(sweep_kernels::kMaxBoxes - count));
        for (size_t i = order.size(); i-- > 1;) std::swap(order[i], order[random.bits() % (i + 1)]);
      }
      const Split wanted = best_split(boxes, orders);
      const std::array<const uint8_t*, 3> pointers{orders[0].data(), orders[1].data(), orders[2].data()};
      for (const sweep_kernels::Kernels* kernels : kernel_sets(sweep_kernels::kPortable, sweep_kernels::kernels()))
        expect_equal(kernels->split_orders(boxes.data(), pointers.data(), count), wanted);
    }
}

} // namespace
} // namespace packtrace
