#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/trees/bin_kernels.h"
#include "compress/format/trees/box_tree.h"
#include "tests/compress/bvh/kernel_sets.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using bin_kernels::Bins;
using test::kernel_sets;

const float* floats_of(const std::vector<TreeBox>& boxes) { return reinterpret_cast<const float*>(boxes.data()); }

/// @param places number of different coordinates along x; along z all centres are equal
std::vector<TreeBox> boxes_at(uint32_t count, uint32_t places, test::Random& random) {
  std::vector<TreeBox> boxes(count);
  for (TreeBox& box : boxes) {
    const auto x = static_cast<float>(random.bits() % places);
    const float y = random.uniform(-5.0f, 20.0f), z = random.uniform(0.0f, 3.0f);
    box = {{x, y, -z}, {x + random.uniform(0.0f, 0.1f), y + random.uniform(0.0f, 2.0f), z}};
  }
  return boxes;
}

double place_of(const TreeBox& box, size_t axis) {
  return 2.0 * double{static_cast<float>(0.5 * (double{box.lo[axis]} + box.hi[axis]))};
}

uint32_t bin_of(const TreeBox& box, size_t axis, const Bins& bins) {
  return std::min(static_cast<uint32_t>((place_of(box, axis) - bins.low[axis]) * bins.scale[axis]), bins.count - 1);
}

TreeBox bounds_of(const std::vector<TreeBox>& boxes) {
  TreeBox out = boxes[0];
  for (const TreeBox& box : boxes) out.extend(box);
  return out;
}

Bins bins_of(const std::vector<TreeBox>& boxes, uint32_t count) {
  Bins bins{{}, {}, count};
  for (size_t axis = 0; axis < 3; ++axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const TreeBox& box : boxes)
      low = std::min(low, place_of(box, axis)), high = std::max(high, place_of(box, axis));
    bins.low[axis] = low, bins.scale[axis] = high > low ? count / (high - low) : 0.0;
  }
  return bins;
}

struct Side {
  TreeBox bounds; ///< undefined if it has no boxes
  uint32_t count = 0;
  void extend(const Side& other) {
    if (other.count == 0) return;
    if (count == 0) bounds = other.bounds;
    bounds.extend(other.bounds);
    count += other.count;
  }
};

/// Tries all splits between bins; sorts the boxes of the best one into `order`. Returns the number on the left.
uint32_t split_plainly(const std::vector<TreeBox>& boxes, const Bins& bins, uint32_t unit,
                       std::vector<uint32_t>& order) {
  double least = std::numeric_limits<double>::infinity();
  size_t best_axis = 0;
  uint32_t best = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    std::vector<Side> in_bin(bins.count);
    for (const TreeBox& box : boxes) in_bin[bin_of(box, axis, bins)].extend({box, 1});
    for (uint32_t bin = 1; bin < bins.count; ++bin) {
      std::array<Side, 2> sides;
      for (uint32_t i = 0; i < bins.count; ++i) sides[i < bin ? 0 : 1].extend(in_bin[i]);
      if (sides[0].count == 0 || sides[1].count == 0) continue;
      double cost = 0.0;
      for (const Side& side : sides)
        cost += side.bounds.half_area() * static_cast<double>((side.count + unit - 1) / unit);
      if (cost < least) least = cost, best_axis = axis, best = bin;
    }
  }
  if (best == 0) return 0;
  const auto middle =
      std::partition(order.begin(), order.end(), [&](uint32_t i) { return bin_of(boxes[i], best_axis, bins) < best; });
  return static_cast<uint32_t>(middle - order.begin());
}

TEST(BinKernels, SplitWhereItCostsLeast) {
  test::Random random(3);
  for (const uint32_t count : {2u, 3u, 7u, 8u, 63u, 64u, 65u, 129u, 1000u, 32768u, 32769u})
    for (const uint32_t places : {1u, 2u, 1000u})
      for (const uint32_t unit : {1u, 3u, 128u}) {
        if (count > 1000 && (places == 2 || unit == 3)) continue;
        SCOPED_TRACE(std::to_string(count) + " boxes at " + std::to_string(places) + " places, unit " +
                     std::to_string(unit));
        const std::vector<TreeBox> boxes = boxes_at(count, places, random);
        const Bins bins = bins_of(boxes, std::min(bin_kernels::kMaxBins, 2 * count));
        std::vector<uint32_t> numbers(count);
        std::iota(numbers.begin(), numbers.end(), 0u);
        std::vector<uint32_t> wanted = numbers;
        const uint32_t left = split_plainly(boxes, bins, unit, wanted);
        for (const bin_kernels::Kernels* kernels : kernel_sets(bin_kernels::kPortable, bin_kernels::kernels())) {
          std::vector<uint32_t> order = numbers;
          EXPECT_EQ(kernels->split({floats_of(boxes), order.data(), count}, bins, unit), left);
          EXPECT_EQ(order, wanted);
        }
      }
}

TEST(BinKernels, EqualCentresAreNotSplit) {
  std::vector<TreeBox> boxes;
  for (int i = 0; i < 100; ++i) {
    const auto reach = static_cast<float>(i);
    boxes.push_back({{1 - reach, 2 - reach, 3}, {1 + reach, 2 + reach, 3}});
  }
  std::vector<uint32_t> order(boxes.size());
  std::iota(order.begin(), order.end(), 0u);
  for (const bin_kernels::Kernels* kernels : kernel_sets(bin_kernels::kPortable, bin_kernels::kernels()))
    EXPECT_EQ(kernels->split({floats_of(boxes), order.data(), 100}, bins_of(boxes, 64), 1), 0u);
}

TEST(BinKernels, MeasureBoxesAndCentres) {
  test::Random random(4);
  std::vector<TreeBox> boxes = boxes_at(100, 50, random);
  const std::vector<uint32_t> numbers{99, 3, 57, 0, 1};
  std::vector<TreeBox> chosen;
  for (const uint32_t i : numbers) chosen.push_back(boxes[i]);
  const TreeBox whole = bounds_of(chosen);
  for (const bin_kernels::Kernels* kernels : kernel_sets(bin_kernels::kPortable, bin_kernels::kernels()))
    for (uint32_t count = 1; count <= numbers.size(); ++count) {
      std::vector<uint32_t> order = numbers;
      bin_kernels::RunBounds bounds;
      kernels->measure({floats_of(boxes), order.data(), count}, bounds);
      for (size_t axis = 0; axis < 3; ++axis) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (uint32_t i = 0; i < count; ++i) {
          low = std::min(low, 0.5 * place_of(chosen[i], axis)), high = std::max(high, 0.5 * place_of(chosen[i], axis));
        }
        EXPECT_EQ(bounds.centres[axis], low);
        EXPECT_EQ(bounds.centres[3 + axis], high);
        if (count < numbers.size()) continue;
        EXPECT_EQ(bounds.boxes[axis], whole.lo[axis]);
        EXPECT_EQ(bounds.boxes[3 + axis], whole.hi[axis]);
      }
    }
}

} // namespace
} // namespace packtrace
