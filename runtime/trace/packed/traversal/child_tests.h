#pragma once

#include "runtime/trace/packed/kernels/batch_strips.h"
#include "runtime/trace/packed/kernels/beam.h"
#include "runtime/trace/packed/kernels/group_bounds.h"
#include "runtime/trace/packed/kernels/leaf_tests.h"
#include "runtime/trace/packed/kernels/node_children.h"
#include "runtime/trace/packed/kernels/side_by_side.h"

namespace packtrace::packed {
namespace {

/// A stack entry: a node or placement, and the rays that are to visit it.
struct Pending {
  uint64_t rays; ///< bit mask
  uint32_t node;
  float t; ///< t at which the first of the rays, or the beam, enters the box; 0 for any hits
};

/// Tests the rays of a group against the boxes of a node's children.
template <typename Lanes, bool kAny>
struct ChildTests {
  /// Tests rays against the children in the bit mask `slots`. Returns the mask of the children that any ray hits.
  /// @param by_child output, per child: mask of the rays that hit its box
  /// @param t for nearest hits: where the first ray enters each child; for a beam, a lower bound over its rays
  template <typename Group>
  static uint32_t pass(const typename Lanes::Boxes& boxes, const Group& group, uint64_t rays, uint32_t slots,
                       uint64_t (&by_child)[baked::kNodeWidth], float (&t)[baked::kNodeWidth]) {
    if constexpr (!kAny && Group::kTriangles)
      if (group.beam != nullptr) {
        slots &= pass_beam(boxes, *group.beam, t);
        if (slots == 0) return 0;
        return pass_side_by_side(boxes, group, rays, slots, by_child);
      }
    if (kAny && count_ones(rays) < kMinSideBySideRays)
      return slots & Lanes::Children::pass(boxes, group, rays, by_child);
    return pass_apart(boxes, group, rays, slots, by_child, t);
  }

  /// Does the same for rays that form no beam. It is a function of its own because the compiler generates slower code
  /// for beams if both are one function.
  template <typename Group>
  [[gnu::noinline]] static uint32_t pass_apart(const typename Lanes::Boxes& boxes, const Group& group, uint64_t rays,
                                               uint32_t slots, uint64_t (&by_child)[baked::kNodeWidth],
                                               float (&t)[baked::kNodeWidth]) {
    const bool many = count_ones(rays) >= kMinSideBySideRays;
    if (many) {
      slots &= pass_group_bounds(boxes, group.reach);
      if (slots == 0) return 0;
    }
    if constexpr (!kAny) Lanes::Children::enter(boxes, group, first_bit(rays), t);
    if (many && prefers_side_by_side<typename Lanes::WideLanes>(rays, slots))
      return pass_side_by_side(boxes, group, rays, slots, by_child);
    return slots & Lanes::Children::pass(boxes, group, rays, by_child);
  }

  template <typename Group>
  [[gnu::always_inline]] static uint32_t pass_side_by_side(const typename Lanes::Boxes& boxes, const Group& group,
                                                           uint64_t rays, uint32_t slots,
                                                           uint64_t (&by_child)[baked::kNodeWidth]) {
    BoxPlanes planes;
    read_planes(boxes, planes);
    return test_boxes_side_by_side<typename Lanes::WideLanes>(planes, group, rays, slots, by_child);
  }

  /// Pushes the children of a node that rays hit. For nearest hits the child that the first ray enters first ends on
  /// top of the stack; for any hits, the first child in the tree's order.
  template <typename Group, typename Number>
  static void push_children(const typename Lanes::Boxes& boxes, const Group& group, uint64_t rays, uint32_t slots,
                            Pending* stack, uint32_t& size, Number number) {
    uint64_t by_child[baked::kNodeWidth];
    float t[baked::kNodeWidth] = {};
    slots = pass(boxes, group, rays, slots, by_child, t);
    if constexpr (kAny) {
      while (slots != 0) {
        const uint32_t slot = 31u - static_cast<uint32_t>(__builtin_clz(slots));
        slots &= ~(1u << slot);
        stack[size++] = {by_child[slot], number(slot), 0.0f};
      }
      return;
    }
    const uint32_t begin = size;
    for (; slots != 0; slots &= slots - 1) {
      const auto slot = static_cast<uint32_t>(__builtin_ctz(slots));
      uint32_t at = size++;
      for (; at > begin && stack[at - 1].t < t[slot]; --at) stack[at] = stack[at - 1];
      stack[at] = {by_child[slot], number(slot), t[slot]};
    }
  }
};

} // namespace
} // namespace packtrace::packed
