#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "runtime/trace/packed/kernels/enter.h"
#include "runtime/trace/packed/kernels/lanes_scalar.h"
#include "runtime/trace/packed/kernels/leaf_tests.h"

namespace packtrace::packed {
namespace {

constexpr float kMax = 0x1p20f; ///< largest coordinate
constexpr double kUlp = 0x1p-24 * double{kMax};

TracePlacement whole_grid() {
  TracePlacement placement{};
  for (size_t axis = 0; axis < 3; ++axis)
    placement.grid_from_unit[4 * axis] = 1, placement.box_lo[axis] = -kMax, placement.box_hi[axis] = kMax;
  placement.aligned = 1;
  return placement;
}

struct Box {
  float lo[3], hi[3];
};

TopNode node_of(std::initializer_list<Box> boxes) {
  TopNode node{};
  uint32_t slot = 0;
  for (const Box& box : boxes) {
    for (size_t axis = 0; axis < 3; ++axis) node.lo[axis][slot] = box.lo[axis], node.hi[axis][slot] = box.hi[axis];
    node.slots |= 1u << slot++;
  }
  return node;
}

/// 64 rays that start just above x = 0 and y = 0 and go down, towards larger x.
UnitRays rays_beside_an_edge(std::mt19937& generator, double height) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  UnitRays rays{};
  for (uint32_t i = 0; i < kGroup; ++i) {
    rays.origin[0][i] = static_cast<float>(kUlp * std::exp(-12 * unit(generator)));
    rays.origin[1][i] = static_cast<float>(height * kUlp * (0.2 + 0.8 * unit(generator)));
    rays.origin[2][i] = static_cast<float>((unit(generator) - 0.5) * double{kMax} / 2);
    rays.direction[0][i] = static_cast<float>(std::exp(-8 * unit(generator)));
    rays.direction[1][i] = static_cast<float>(-0.3 - 0.7 * unit(generator));
    rays.direction[2][i] = 1.0f;
    rays.tmax[i] = 3e38f;
  }
  return rays;
}
constexpr uint32_t kDown = 2; ///< octant of their directions

TEST(GroupBounds, HoldsBoxesWithAnExtentThatEndAPadBeforeRaysStart) {
  std::mt19937 generator(1);
  RayGroup group;
  enter<false>(whole_grid(), kMax, kMax, rays_beside_an_edge(generator, 4), ~uint64_t{0}, group);
  group.reach.set_octant(kDown);
  const TopNode node = node_of({{{-kMax, 0, -kMax}, {0, 0, kMax}},              // beside the edge
                                {{0, 0, -kMax}, {0, kMax, kMax}},               // a wall at x = 0
                                {{-kMax, 0, -kMax}, {-0.001f * kMax, 0, kMax}}, // farther away than the pad
                                {{0, -kMax, -kMax}, {kMax, 0, kMax}}});         // below the rays
  EXPECT_EQ(pass_group_bounds(GroupBoxes<ScalarLanes>(node, kDown), group.reach) & node.slots, 0b1001u);
}

TEST(GroupBounds, HoldsWhatTheTriangleTestAcceptsBesideIt) {
  // A ground of two halves, each with its own box. At their common edge rounding decides which half is hit.
  const float corners[4][3][3] = {{{0, 0, -kMax}, {0, 0, kMax}, {-kMax, 0, -kMax}},
                                  {{0, 0, -kMax}, {kMax, 0, kMax}, {0, 0, kMax}},
                                  {{0, 0, kMax}, {-kMax, 0, kMax}, {-kMax, 0, -kMax}},
                                  {{0, 0, -kMax}, {kMax, 0, -kMax}, {kMax, 0, kMax}}};
  constexpr uint32_t kLeft = 0b0101;
  DecodedBatch batch{};
  batch.count = 4;
  for (uint32_t lane = 0; lane < kBatch; ++lane)
    for (uint32_t corner = 0; corner < 3; ++corner)
      for (uint32_t axis = 0; axis < 3; ++axis) batch.vertex[axis][corner][lane] = corners[lane & 3][corner][axis];
  const BatchNormals normals = batch_normals<ScalarLanes>(batch);
  const TopNode node = node_of({{{-kMax, 0, -kMax}, {0, 0, kMax}}, {{0, 0, -kMax}, {kMax, 0, kMax}}});
  const GroupBoxes<ScalarLanes> boxes(node, kDown);
  std::mt19937 generator(2);
  uint32_t only_left = 0;
  for (uint32_t turn = 0; turn < 2000; ++turn) {
    RayGroup group;
    const uint64_t entered =
        enter<false>(whole_grid(), kMax, kMax, rays_beside_an_edge(generator, 2), ~uint64_t{0}, group);
    group.reach.set_octant(kDown);
    const uint32_t slots = pass_group_bounds(boxes, group.reach);
    for (uint64_t rays = entered; rays != 0; rays &= rays - 1) {
      LaneHits<ScalarLanes> hits;
      uint64_t exact = 0;
      const uint32_t hit =
          test_triangles<ScalarLanes, false>(batch, normals, group, first_bit(rays), FineGrid<false>(), hits, exact) &
          15u;
      only_left += hit != 0 && (hit & ~kLeft) == 0;
      ASSERT_TRUE((hit & kLeft) == 0 || (slots & 1u) != 0);
      ASSERT_TRUE((hit & ~kLeft) == 0 || (slots & 2u) != 0);
    }
  }
  EXPECT_GT(only_left, 0u) << "no ray was one for rounding to decide";
}

} // namespace
} // namespace packtrace::packed
