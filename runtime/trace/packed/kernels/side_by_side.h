#pragma once

#include "runtime/trace/packed/kernels/group_boxes.h"

/// Tests each box of a node against a register of neighbouring rays, one ray per lane, instead of each ray against
/// eight boxes. The arithmetic is the same in other lanes, so the results are the same bits.
namespace packtrace::packed {
namespace {

/// Returns the bits of `rays` from bit `first` on that correspond to one register, as a lane mask.
template <typename WideLanes>
inline uint32_t lanes_at(uint64_t rays, uint32_t first) {
  return static_cast<uint32_t>(rays >> first) & ((1u << WideLanes::kLanes) - 1);
}

/// Whether testing rays in SIMD lanes beats testing boxes in lanes: registers of rays times boxes must be below two
/// thirds of the number of rays.
template <typename WideLanes>
inline bool prefers_side_by_side(uint64_t rays, uint32_t slots) {
  uint32_t registers = 0;
  for (uint32_t at = 0; at < kGroup; at += WideLanes::kLanes) registers += lanes_at<WideLanes>(rays, at) != 0 ? 1 : 0;
  return 3 * registers * static_cast<uint32_t>(__builtin_popcount(slots)) <
         2 * static_cast<uint32_t>(__builtin_popcountll(rays));
}

/// Near and far planes of a node's children.
struct BoxPlanes {
  float near[3][baked::kNodeWidth], far[3][baked::kNodeWidth];
};

template <typename Lanes>
inline void read_planes(const GroupBoxes<Lanes>& boxes, BoxPlanes& planes) {
  for (uint32_t axis = 0; axis < 3; ++axis) {
    Lanes::store(planes.near[axis], boxes.near[axis]);
    Lanes::store(planes.far[axis], boxes.far[axis]);
  }
}

/// Tests the children of the bit mask `slots`. Returns the mask of the children that any ray hits.
/// @param out output, per child: mask of those of `rays` that hit its box; 0 for children not in `slots`
template <typename WideLanes>
[[gnu::always_inline]] inline uint32_t test_boxes_side_by_side(const BoxPlanes& planes, const SideBySideRays& group,
                                                               uint64_t rays, uint32_t slots,
                                                               uint64_t (&out)[baked::kNodeWidth]) {
  using F = typename WideLanes::F;
  for (uint64_t& word : out) word = 0;
  for (uint32_t at = 0; at < kGroup; at += WideLanes::kLanes) {
    if (lanes_at<WideLanes>(rays, at) == 0) continue;
    const F ray_begin = WideLanes::load(&group.begin[at]), ray_end = WideLanes::load(&group.end[at]);
    F inverse[3], near_bias[3], far_bias[3];
    for (uint32_t axis = 0; axis < 3; ++axis) {
      inverse[axis] = WideLanes::load(&group.inverse[axis][at]);
      near_bias[axis] = WideLanes::load(&group.near_bias[axis][at]);
      far_bias[axis] = WideLanes::load(&group.far_bias[axis][at]);
    }
    for (uint32_t m = slots; m != 0; m &= m - 1) {
      const auto slot = static_cast<uint32_t>(__builtin_ctz(m));
      F begin = ray_begin, end = ray_end;
      for (uint32_t axis = 0; axis < 3; ++axis) {
        begin = WideLanes::max(begin,
                               WideLanes::fma(WideLanes::set(planes.near[axis][slot]), inverse[axis], near_bias[axis]));
        end =
            WideLanes::min(end, WideLanes::fma(WideLanes::set(planes.far[axis][slot]), inverse[axis], far_bias[axis]));
      }
      out[slot] |= uint64_t{WideLanes::less_equal(begin, end)} << at;
    }
  }
  uint32_t used = 0;
  for (uint32_t m = slots; m != 0; m &= m - 1) {
    const auto slot = static_cast<uint32_t>(__builtin_ctz(m));
    out[slot] &= rays;
    used |= (out[slot] != 0 ? 1u : 0u) << slot;
  }
  return used;
}

} // namespace
} // namespace packtrace::packed
