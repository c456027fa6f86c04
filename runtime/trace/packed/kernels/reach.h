#pragma once

#include "runtime/trace/packed/kernels/group_boxes.h"

/// What the rays of a group reach together. A node's boxes that lie outside are passed by none of them, and of those
/// that are left, few of eight where many rays come, each is tested against a register of rays.
///
/// The box holds all that rays come to, and a pad for what the triangle test accepts beside it (kReachPad). Where rays
/// start, boxes without an extent along that axis are compared without the pad. All that lies in such a box lies in one
/// plane x = B along the axes, and a ray that starts at x > B and goes on along x, or across it, never comes there: the
/// plane's normal has one component, so that t has the right sign whatever is rounded, and is not above 0. That matters
/// where rays start beside a ground or a wall, of which they are off by less than the pad: none of them comes to it
/// again. A box with an extent needs the pad there too. Its triangles lie behind, but where one shares an edge with a
/// triangle that is hit, the rounded edge may give the ray to it. Parts of placements are
/// as flat as their boxes in floats can be; where a ray comes to none of them, it hits nothing but for rounding.
namespace packtrace::packed {
namespace {

/// Rays end there at the latest, in units of the largest coordinate M: they start within 4 M of the grid's zero and go
/// by 1 or more along an axis.
constexpr float kReachEnd = 6.0f;
/// The pad, times M: with u = 2^-24, 11 u 4 M for the triangle test of origins up to 4 M (see kBoxPad), and 40 u M for
/// the three roundings of an end, 12 M away from a start of 4 M.
constexpr float kReachPad = 96.0f * 0x1p-24f;
/// Extents of boxes in unit space that are none but for rounding, times M.
constexpr float kUnitFlat = 0x1p-21f;
/// What makes the least extent more than any pad.
constexpr float kAnyExtent = 0x1p100f;
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

  /// @param flat extents up to this count as none
  void read(float flat, Reach& out) const {
    float most[8];
    const Floats all[8] = {most_[0], most_[1], most_[2], most_[3], most_[4], most_[5], most_[5], most_[5]};
    largest_lanes(all, most);
    for (uint32_t axis = 0; axis < 3; ++axis) out.lo[axis] = -most[axis], out.hi[axis] = most[3 + axis];
    out.flat = flat;
    out.pad[0] = 0.0f, out.pad[1] = pad_;
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
    const F extent =
        Lanes::sub(Lanes::mul(Lanes::sub(boxes.far[axis], boxes.near[axis]), sign), Lanes::set(reach.flat));
    const F pad =
        Lanes::min(Lanes::max(Lanes::mul(extent, Lanes::set(kAnyExtent)), Lanes::set(0.0f)), Lanes::set(reach.pad[1]));
    const F start = Lanes::sub(Lanes::set(reach.shift[axis][1]), pad);
    most = Lanes::max(most, Lanes::sub(start, Lanes::mul(boxes.far[axis], sign)));
  }
  return Lanes::less_equal(most, Lanes::set(0.0f));
}

} // namespace
} // namespace packtrace::packed
