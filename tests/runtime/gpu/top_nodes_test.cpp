#include "runtime/gpu/top_nodes.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

/// Nodes whose boxes lie in [-size, size] around a centre, flat along some axes.
std::vector<packed::TopNode> random_nodes(double centre, double size, uint32_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-size, size);
  std::vector<packed::TopNode> nodes(count);
  for (packed::TopNode& node : nodes) {
    node.slots = 1 + static_cast<uint32_t>(random() % 255);
    for (uint32_t slot = 0; slot < baked::kNodeWidth; ++slot) {
      node.child[slot] = static_cast<uint32_t>(random());
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<float>(centre + place(random)), b = static_cast<float>(centre + place(random));
        node.lo[axis][slot] = std::min(a, b);
        node.hi[axis][slot] = random() % 4 == 0 ? node.lo[axis][slot] : std::max(a, b);
      }
    }
  }
  return nodes;
}

double plane(const gpu::TopNodeRecord& record, uint32_t axis, uint8_t byte) {
  const int exponent = static_cast<int>(record.exponents >> (8 * axis) & 255) - 127;
  return double{record.origin[axis]} + std::ldexp(byte, exponent);
}

class TopNodeRecords : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(TopNodeRecords, EncloseTheBoxes) {
  const auto [centre, size] = GetParam();
  const std::vector<packed::TopNode> nodes = random_nodes(centre, size, 500);
  const std::vector<gpu::TopNodeRecord> records = gpu::pack_top_nodes(nodes);
  ASSERT_EQ(records.size(), nodes.size());
  for (size_t i = 0; i < nodes.size(); ++i)
    for (uint32_t slot = 0; slot < baked::kNodeWidth; ++slot) {
      EXPECT_EQ(records[i].child[slot], nodes[i].child[slot]);
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const uint8_t lo = records[i].lo[axis][slot], hi = records[i].hi[axis][slot];
        if ((nodes[i].slots >> slot & 1) == 0) {
          EXPECT_GT(lo, hi);
          continue;
        }
        // Both planes lie outwards by more than what rounding moves them in the kernels, and by little more than a
        // step.
        const double rounding = 0x1p-23 * (std::abs(centre) + size), step = 2.0 * size / 127.0 + 16.0 * rounding;
        const double box_lo = nodes[i].lo[axis][slot], box_hi = nodes[i].hi[axis][slot];
        EXPECT_LE(plane(records[i], axis, lo), box_lo - 0x1p-23 * std::abs(box_lo));
        EXPECT_GE(plane(records[i], axis, hi), box_hi + 0x1p-23 * std::abs(box_hi));
        EXPECT_GE(plane(records[i], axis, lo), box_lo - 2.0 * step - 0x1p-98);
        EXPECT_LE(plane(records[i], axis, hi), box_hi + 2.0 * step + 0x1p-98);
      }
    }
}

INSTANTIATE_TEST_SUITE_P(Scales, TopNodeRecords,
                         testing::Values(std::pair(0.0, 1.0), std::pair(0.0, 0x1p21), std::pair(-3e5, 1e-3),
                                         std::pair(1e6, 0.0), std::pair(0.0, 1e-30), std::pair(2e-20, 1e-36)));

} // namespace
} // namespace packtrace
