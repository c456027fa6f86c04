#pragma once

#include "runtime/trace/packed/kernels/side_by_side.h"

/// Rays from one place into one octant, as camera rays are. What they have in common decides about most boxes at once;
/// the others, and triangles, are tested against a register of rays each. Which is right where neighbours agree.
namespace packtrace::packed {
namespace {

/// By how much the planes of boxes are moved for a beam, in units of u M as for kBoxPad: the node's origin and its
/// plane (1 M each), less the padded origin (1 M + 2 M), times a rounded inverse (2 M + 2 M), besides 10 u M of the
/// triangle test.
constexpr float kBeamPad = 28.0f * 0x1p-24f;

struct alignas(64) Beam {
  /// Of all: what near and negated far planes are less, inverse directions' least and most, and as RayGroup::limits.
  float origin[3][2], inverse[3][2], limits[2];
  bool stale; ///< limits are

  /// After RayGroup::set_tmax().
  void update_limits(const RayGroup& group) {
    stale = false;
    Floats most, some;
    read_block(most, &group.end[0]);
    for (uint32_t first = kBlock; first < kGroup; first += kBlock) {
      read_block(some, &group.end[first]);
      keep_larger(most, some);
    }
    limits[1] = -largest_lane(most);
  }
};

constexpr uint32_t kLeastBeam = 16; ///< rays that make a beam worth its setup

/// Makes a beam of all of a group's rays. False where they have no origin or octant in common, or are few.
/// @param group lanes of other rays get values of one of `rays`
inline bool make_beam(RayGroup& group, float max_coordinate, uint64_t rays, Beam& beam) {
  if (static_cast<uint32_t>(__builtin_popcountll(rays)) < kLeastBeam) return false;
  const auto first = static_cast<uint32_t>(__builtin_ctzll(rays));
  for (uint32_t at = 0; at < kGroup; at += kBlock) {
    Ints same = Ints{} - 1;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Floats origin;
      read_block(origin, &group.origin[axis][at]);
      same &= origin == group.origin[axis][first];
    }
    if ((static_cast<uint32_t>(rays >> at) & kBlockLanes & ~lane_bits(same)) != 0) return false;
  }
  for (const uint64_t backward : group.backward)
    if ((backward & rays) != 0 && (backward & rays) != rays) return false;
  for (uint64_t m = ~rays; m != 0; m &= m - 1) {
    const auto i = static_cast<uint32_t>(__builtin_ctzll(m));
    for (uint32_t axis = 0; axis < 3; ++axis) {
      group.inverse[axis][i] = group.inverse[axis][first];
      group.near_bias[axis][i] = group.near_bias[axis][first], group.far_bias[axis][i] = group.far_bias[axis][first];
    }
    group.begin[i] = __builtin_inff();
    group.end[i] = -__builtin_inff();
  }
  float reach = max_coordinate;
  for (uint32_t axis = 0; axis < 3; ++axis) reach = __builtin_fmaxf(reach, __builtin_fabsf(group.origin[axis][first]));
  for (uint32_t axis = 0; axis < 3; ++axis) {
    Floats least = Floats{} + group.inverse[axis][first], most = least;
    for (uint32_t at = 0; at < kGroup; at += kBlock) {
      Floats inverse;
      read_block(inverse, &group.inverse[axis][at]);
      keep_larger(most, inverse);
      least = inverse < least ? inverse : least;
    }
    beam.inverse[axis][0] = -largest_lane(-least), beam.inverse[axis][1] = largest_lane(most);
    const float pad = least[0] < 0.0f ? -kBeamPad * reach : kBeamPad * reach; // outwards is towards the rays' origin
    beam.origin[axis][0] = group.origin[axis][first] + pad, beam.origin[axis][1] = -group.origin[axis][first] + pad;
  }
  Floats least, begin;
  read_block(least, &group.begin[0]);
  for (uint32_t at = kBlock; at < kGroup; at += kBlock) {
    read_block(begin, &group.begin[at]);
    least = begin < least ? begin : least;
  }
  beam.limits[0] = -largest_lane(-least);
  beam.update_limits(group);
  return true;
}

/// Which of a node's boxes a beam as a whole may pass, and where it enters them.
template <typename Lanes>
inline uint32_t pass_beam(const GroupBoxes<Lanes>& boxes, const Beam& beam, float (&t)[baked::kNodeWidth]) {
  using F = typename Lanes::F;
  F begin = Lanes::set(beam.limits[0]), end = Lanes::set(-beam.limits[1]);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const F near = Lanes::sub(boxes.near[axis], Lanes::set(beam.origin[axis][0])),
            far = Lanes::add(boxes.far[axis], Lanes::set(beam.origin[axis][1]));
    const F least = Lanes::set(beam.inverse[axis][0]), most = Lanes::set(beam.inverse[axis][1]);
    begin = Lanes::max(begin, Lanes::min(Lanes::mul(near, least), Lanes::mul(near, most)));
    end = Lanes::min(end, Lanes::max(Lanes::mul(far, least), Lanes::mul(far, most)));
  }
  Lanes::store(t, begin);
  return Lanes::less_equal(begin, end);
}

} // namespace
} // namespace packtrace::packed
