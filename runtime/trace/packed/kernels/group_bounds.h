#pragma once

#include "runtime/trace/packed/kernels/group_boxes.h"

/// The bounds of a ray group are the bounding box of all points at which its rays may hit something. No ray of the
/// group hits a box outside them, so one test of a node's eight boxes culls boxes for the whole group. Where many
/// rays visit a node, few of its boxes remain, and each of them is tested against a register of rays.
///
/// The bounds hold the origins and ends of the rays and are padded by kGroupPad, because the triangle test may accept
/// hits slightly off the ray. There is one exception: at the side where the rays start, boxes that are flat along the
/// axis are compared without the pad. All geometry in such a box lies in one plane x = B. A ray that starts at x > B
/// and moves away from the plane or parallel to it never reaches the plane: its normal has one nonzero component, so t
/// has the right sign whatever is rounded and is not above 0. This matters for rays that start just off a ground plane
/// or a wall. Their distance to it is less than the pad, but they cannot hit it again.
///
/// Boxes with an extent keep the pad at that side as well. Their triangles lie behind the rays, but one of them may
/// share an edge with a triangle that is hit, and rounding may attribute the hit to the triangle behind.
///
/// The boxes of a placement's parts (KernelScene::parts) are rounded outwards to floats, so they are never exactly
/// flat; extents up to kUnitFlat M count as flat there. A ray that is culled by this rule could hit the placement
/// through rounding only.
namespace packtrace::packed {
namespace {

/// Limit of t, in units of the largest coordinate M. Rays start within 4 M of the grid's zero and their largest
/// direction component is at least 1, so they have left the tree by t = 5 M.
constexpr float kGroupMaxT = 6.0f;
/// The pad in units of M. With u = 2^-24, the triangle test needs 11 u 4 M for origins up to 4 M (see kBoxPad), and the
/// three roundings of a ray's end, up to 12 M away from a start at 4 M, need 40 u M.
constexpr float kGroupPad = 96.0f * 0x1p-24f;
/// Extents of boxes in unit space that count as flat, in units of M. They come from rounding.
constexpr float kUnitFlat = 0x1p-21f;
/// Scales any nonzero extent above every pad.
constexpr float kExtentScale = 0x1p100f;
/// Up to this coordinate, node planes and vertices are integers that floats represent exactly.
constexpr float kExactPlanes = 0x1p23f;

/// Computes the bounds of a group's rays.
class GroupBoundsFinder {
public:
  /// @param max_coordinate largest absolute coordinate M of the tree
  explicit GroupBoundsFinder(float max_coordinate)
      : end_(kGroupMaxT * max_coordinate), pad_(kGroupPad * max_coordinate),
        start_pad_(max_coordinate <= kExactPlanes ? 0.0f : pad_) {
    for (Floats& most : most_) most = Floats{} - __builtin_inff();
  }

  /// @tparam kNearest whether t counts from the origin before it was rounded to floats; the start is then less certain
  /// by that rounding
  /// @param lanes bit mask of the rays of the block to include
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

  /// @param flat largest extent that counts as flat
  void read(float flat, GroupBounds& out) const {
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
  Floats most_[6]; ///< maxima of -x, -y, -z, x, y, z
};

/// Returns the boxes of a node that overlap the group's bounds, as a bit mask.
template <typename Lanes>
inline uint32_t pass_group_bounds(const GroupBoxes<Lanes>& boxes, const GroupBounds& bounds) {
  using F = typename Lanes::F;
  F most = Lanes::set(-__builtin_inff());
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const F sign = Lanes::set(bounds.sign[axis]);
    most = Lanes::max(most, Lanes::add(Lanes::mul(boxes.near[axis], sign), Lanes::set(bounds.shift[axis][0])));
    const F extent =
        Lanes::sub(Lanes::mul(Lanes::sub(boxes.far[axis], boxes.near[axis]), sign), Lanes::set(bounds.flat));
    const F pad = Lanes::min(Lanes::max(Lanes::mul(extent, Lanes::set(kExtentScale)), Lanes::set(0.0f)),
                             Lanes::set(bounds.pad[1]));
    const F start = Lanes::sub(Lanes::set(bounds.shift[axis][1]), pad);
    most = Lanes::max(most, Lanes::sub(start, Lanes::mul(boxes.far[axis], sign)));
  }
  return Lanes::less_equal(most, Lanes::set(0.0f));
}

} // namespace
} // namespace packtrace::packed
