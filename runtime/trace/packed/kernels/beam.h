#pragma once

#include "runtime/trace/packed/kernels/side_by_side.h"

/// A beam is a group of rays with a common origin and octant, such as camera rays. One conservative test of the whole
/// beam culls most boxes. The remaining boxes, and triangles, are tested against a register of rays each, which pays
/// off because neighbouring rays mostly agree.
namespace packtrace::packed {
namespace {

/// Box planes are moved outwards by this times M for a beam; kBoxPad explains the units: the node's origin and its
/// plane (1 M each), the subtraction of the padded origin (1 M + 2 M), its product with a rounded inverse (2 M + 2 M),
/// and 10 u M of the triangle test.
constexpr float kBeamPad = 28.0f * 0x1p-24f;

/// Enlarges a node's boxes by kBeamPad times the largest coordinate of the node. This covers the rounding errors of
/// boxes and triangles, so the pads of rays cover only those of the rays' own origins. A child's coordinates are at
/// most its parent's, so pads shrink towards the leaves. With a single pad for the whole tree, a few huge triangles
/// would enlarge the boxes of all small ones, and many rays would hit boxes that they miss by far.
template <typename Boxes>
inline void enlarge_boxes(const baked::PackedNode& node, uint32_t octant, Boxes& boxes) {
  float most = 0.0f;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const NodeAxis at(node, axis, false);
    most = __builtin_fmaxf(most,
                           __builtin_fmaxf(__builtin_fabsf(at.origin), __builtin_fabsf(at.origin + 255.0f * at.unit)));
  }
  boxes.enlarge(kBeamPad * most, octant);
}

struct alignas(64) Beam {
  /// Bounds over all rays. origin: subtracted from near planes (first), added to far planes (second), pad included.
  /// inverse: least and greatest reciprocal of the direction. limits: as RayGroup::limits.
  float origin[3][2], inverse[3][2], limits[2];
  bool stale; ///< whether limits are outdated
  /// Whether t is a power of two in (2^-60, 2^60) times the grid's t for every ray, and no origin was moved. Then hits
  /// are recorded a register at a time.
  bool plain;
  float unit_scale[kGroup], grid_scale[kGroup]; ///< t in unit space per t in the grid and the inverse, powers of two

  /// Recomputes limits[1]; needed after RayGroup::set_tmax().
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

constexpr uint32_t kMinBeamRays = 16; ///< minimum number of rays for which a beam is worth its setup

/// Limits of Beam::plain.
constexpr double kLeastPlainScale = 0x1p-60, kMostPlainScale = 0x1p60;

/// Sets the scales of a beam.
inline void set_scales(const RayGroup& group, Beam& beam) {
  uint32_t plain = (1u << kDoubleLanes) - 1;
  for (uint32_t at = 0; at < kGroup; at += kDoubleLanes) {
    Doubles begin, scale;
    read_block(begin, &group.t_begin[at]);
    read_block(scale, &group.t_scale[at]);
    plain &= lanes_between(kLeastPlainScale, begin == 0.0 ? scale : Doubles{}, kMostPlainScale);
    write_block(&beam.unit_scale[at], to_floats(scale));
    write_block(&beam.grid_scale[at],
                to_floats(reinterpret_cast<Doubles>((int64_t{2046} << 52) - reinterpret_cast<Longs>(scale))));
  }
  beam.plain = plain == (1u << kDoubleLanes) - 1;
}

/// Sets origin, inverse and limits of a beam from its group. Rays of the group that are not in the beam must have the
/// inverses of ray `first` and an empty range of t.
/// @param first a ray of the beam
inline void set_bounds(const RayGroup& group, float pad_coordinate, uint32_t first, Beam& beam) {
  float reach = pad_coordinate;
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
    // Outwards: near planes move towards the rays' origin, far planes away from it.
    const float pad = least[0] < 0.0f ? -kBeamPad * reach : kBeamPad * reach;
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
}

/// Makes a beam of all rays of a group. Returns false if they have no common origin or octant, or are too few. Origins
/// that approach() moved may be equal in floats and differ in `rest`; then they are not common.
/// @param pad_coordinate as in enter()
/// @param group its lanes that are not in `rays` get values of one of `rays`, and an empty range of t
inline bool make_beam(RayGroup& group, float pad_coordinate, uint64_t rays, Beam& beam) {
  if (static_cast<uint32_t>(__builtin_popcountll(rays)) < kMinBeamRays) return false;
  const auto first = static_cast<uint32_t>(__builtin_ctzll(rays));
  for (uint32_t at = 0; at < kGroup; at += kBlock) {
    Ints same = Ints{} - 1;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Floats origin, rest;
      read_block(origin, &group.origin[axis][at]);
      read_block(rest, &group.rest[axis][at]);
      same &= (origin == group.origin[axis][first]) & (rest == group.rest[axis][first]);
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
    group.t_begin[i] = group.t_begin[first], group.t_scale[i] = group.t_scale[first];
  }
  set_bounds(group, pad_coordinate, first, beam);
  set_scales(group, beam);
  return true;
}

/// Returns the boxes of a node that some ray of the beam may hit, as a bit mask, and a lower bound of the t at which
/// the beam enters each.
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
