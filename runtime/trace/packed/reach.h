#pragma once

#include "runtime/trace/packed/group_boxes.h"

/// What the rays of a group reach together. A node's boxes that lie outside are passed by none of them, and of those
/// that are left, few of eight where many rays come, each is tested against a register of rays.
///
/// Behind the rays' origins the box ends where they start, without the pad that single rays' box tests have (kBoxPad):
/// let all of a triangle's corners have x <= B, and a ray start at x > B and go on along x, or across it. Its corners
/// sheared with slope s, x_i = (p_i - s z_i) (1 + e_i), |e_i| <= 2^-24, all have p_i < 0. Where the triangle is hit
/// there are weights w_i >= 0 with sum w_i x_i = 0, so with w'_i = w_i (1 + e_i), sum w'_i z_i = sum w'_i p_i / s: a
/// depth behind the origin (and for s = 0 there is none). t is that but for the rounding of weights, so only t within
/// 2^-23 of the largest coordinate of 0 may come out above it, of a hit that is none. That matters where rays start on
/// a plane along the axes, of which they are off by less than the pad: none of them comes to it again.
namespace packtrace::packed {
namespace {

/// Rays end there at the latest, in units of the largest coordinate M: they start within 4 M of the grid's zero and go
/// by 1 or more along an axis.
constexpr float kReachEnd = 6.0f;
/// Where they end the box is larger by this times M: with u = 2^-24, 11 u M for the triangle test (see kBoxPad) and
/// 40 u M for the three roundings of an end, 12 M away from a start of 4 M.
constexpr float kReachPad = 64.0f * 0x1p-24f;
/// Up to here nodes' planes and vertices are whole numbers that floats hold.
constexpr float kExactPlanes = 0x1p23f;

/// Finds the reach of a group's rays.
class ReachFinder {
public:
  /// @param max_coordinate of the tree
  explicit ReachFinder(float max_coordinate)
      : end_(kReachEnd * max_coordinate), pad_(kReachPad * max_coordinate),
        start_pad_(max_coordinate <= kExactPlanes ? 0.0f : pad_) {
    for (Floats& most : most_) most = Floats{} - __builtin_inff();
  }

  /// @tparam kNearest whether t counts from the origin as it was before it was rounded
  /// @param lanes that count, as bits
  template <bool kNearest>
  [[gnu::always_inline]] void add(const RayBlock& block, uint32_t lanes) {
    const Floats end = block.end < end_ ? block.end : Floats{} + end_;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const Floats origin = block.origin[axis], way = block.direction[axis] * end;
      Floats start = Floats{} + start_pad_;
      if constexpr (kNearest) start += 0x1p-23f * magnitude(origin);
      const Floats before = way < 0.0f ? pad_ - way : start, behind = way < 0.0f ? start : way + pad_;
      add(axis, before - origin, lanes);
      add(3 + axis, behind + origin, lanes);
    }
  }

  void read(Reach& out) const {
    float most[8];
    const Floats all[8] = {most_[0], most_[1], most_[2], most_[3], most_[4], most_[5], most_[5], most_[5]};
    largest_lanes(all, most);
    for (uint32_t axis = 0; axis < 3; ++axis) out.lo[axis] = -most[axis], out.hi[axis] = most[3 + axis];
  }

private:
  [[gnu::always_inline]] void add(uint32_t side, const Floats& x, uint32_t lanes) {
    keep_larger(most_[side], lanes, x);
  }

  const float end_, pad_, start_pad_;
  Floats most_[6]; ///< of -x, -y, -z, x, y, z
};

/// Which of a node's boxes lie within reach, as bits.
template <typename Lanes>
inline uint32_t pass_reach(const GroupBoxes<Lanes>& boxes, const Reach& reach) {
  using F = typename Lanes::F;
  F most = Lanes::set(-__builtin_inff());
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const F sign = Lanes::set(reach.sign[axis]);
    most = Lanes::max(most, Lanes::add(Lanes::mul(boxes.near[axis], sign), Lanes::set(reach.shift[axis][0])));
    most = Lanes::max(most, Lanes::sub(Lanes::set(reach.shift[axis][1]), Lanes::mul(boxes.far[axis], sign)));
  }
  return Lanes::less_equal(most, Lanes::set(0.0f));
}

} // namespace
} // namespace packtrace::packed
