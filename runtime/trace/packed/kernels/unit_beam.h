#pragma once

#include "runtime/trace/packed/kernels/beam.h"
#include "runtime/trace/packed/kernels/node_children.h"

/// Bounds of the rays of a beam before they are transformed. They cull placements at the cost of one box test per
/// group.
namespace packtrace::packed {
namespace {

/// A beam in unit space.
struct UnitBeam {
  Beam beam; ///< without scales
  /// Bounds of the directions, all of one octant.
  float least[3], most[3];
  uint32_t octant;
};

/// Relative widening of bounds, 64 u in the units of kBoxPad. It covers the roundings of their computation, and
/// enlarge_boxes() (28 u) of graded trees, which may_enter() leaves out.
constexpr float kWiden = 0x1p-18f;
static_assert(kWiden >= 2.0f * kBeamPad);

/// Sets the inverse directions of a beam from the bounds of its directions along one axis, which have one sign.
inline void set_inverses(float least, float most, uint32_t axis, Beam& beam) {
  constexpr float kLimit = 1.0f / kMinDirectionComponent;
  const bool backward = most <= 0.0f && least < 0.0f;
  const float small = backward ? -most : least, large = backward ? -least : most; // magnitudes
  const float greatest = (small > kMinDirectionComponent ? 1.0f / small : kLimit) * (1.0f + kWiden);
  const float smallest = (large > kMinDirectionComponent ? 1.0f / large : kLimit) * (1.0f - kWiden);
  beam.inverse[axis][0] = backward ? -greatest : smallest;
  beam.inverse[axis][1] = backward ? -smallest : greatest;
}

/// Finds the bounds of a full group of rays of one origin. Returns false if the beam cannot be used: the rays have
/// different octants, a direction of unusual length or an origin far away.
/// @param max_coordinate largest absolute coordinate of the boxes to test, in unit space
inline bool make_unit_beam(const UnitRays& rays, float max_coordinate, UnitBeam& out) {
  // set_inverses() then turns no ray by more than 2^-20, which kWiden covers.
  constexpr float kLeastLength = 0x1p-60f;
  Floats most[8];
  for (Floats& m : most) m = Floats{} - __builtin_inff();
  Ints usable = Ints{} - 1;
  for (uint32_t first = 0; first < kGroup; first += kBlock) {
    Floats length{};
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Floats direction;
      read_block(direction, &rays.direction[axis][first]);
      const Floats opposite = -direction; // NaN is ignored in this order
      most[axis] = opposite > most[axis] ? opposite : most[axis];
      most[3 + axis] = direction > most[3 + axis] ? direction : most[3 + axis];
      keep_larger(length, magnitude(direction));
    }
    usable &= length > kLeastLength;
  }
  if (lane_bits(usable) != kBlockLanes) return false;
  float bounds[8];
  largest_lanes(most, bounds);
  float away = max_coordinate, largest = 0.0f;
  out.octant = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    out.least[axis] = -bounds[axis], out.most[axis] = bounds[3 + axis];
    if (out.least[axis] < 0.0f && out.most[axis] >= 0.0f) return false;
    out.octant |= (out.least[axis] < 0.0f ? 1u : 0u) << axis;
    set_inverses(out.least[axis], out.most[axis], axis, out.beam);
    away = __builtin_fmaxf(away, __builtin_fabsf(rays.origin[axis][0]));
    largest = __builtin_fmaxf(largest, __builtin_fmaxf(-out.least[axis], out.most[axis]));
  }
  if (!(largest < 0x1p60f && away < 0x1p60f)) return false;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const float pad = ((out.octant >> axis) & 1u) != 0 ? -kWiden * away : kWiden * away;
    out.beam.origin[axis][0] = rays.origin[axis][0] + pad, out.beam.origin[axis][1] = -rays.origin[axis][0] + pad;
  }
  out.beam.limits[0] = 0.0f, out.beam.limits[1] = -__builtin_inff();
  return true;
}

/// Whether some ray of a beam may hit a child of the root of a placed tree.
template <typename Boxes>
inline bool may_enter(const TracePlacement& placement, const TraceTree& tree, const UnitRays& rays,
                      const UnitBeam& from) {
  const double* m = placement.grid_from_unit;
  double origin[3], away = tree.max_coordinate;
  Beam beam;
  uint32_t octant = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    double least = 0.0, most = 0.0, size = 0.0;
    origin[axis] = m[9 + axis];
    for (uint32_t i = 0; i < 3; ++i) {
      const double factor = m[3 * i + axis], a = factor * double{from.least[i]}, b = factor * double{from.most[i]};
      least += a < b ? a : b, most += a < b ? b : a;
      size += __builtin_fabs(a) + __builtin_fabs(b);
      origin[axis] += factor * double{rays.origin[i][0]};
    }
    if (!(least > size * 0x1p-20 || most < size * -0x1p-20)) return true;
    if (!(size > 0x1p-60 && size < 0x1p60)) return true;
    octant |= (most < 0.0 ? 1u : 0u) << axis;
    set_inverses(static_cast<float>(least), static_cast<float>(most), axis, beam);
    away = __builtin_fmax(away, __builtin_fabs(origin[axis]));
  }
  if (!(away < 0x1p60)) return true;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const float at = static_cast<float>(origin[axis]), by = kWiden * static_cast<float>(away),
                pad = ((octant >> axis) & 1u) != 0 ? -by : by;
    beam.origin[axis][0] = at + pad, beam.origin[axis][1] = -at + pad;
  }
  beam.limits[0] = 0.0f, beam.limits[1] = -__builtin_inff();
  float t[baked::kNodeWidth];
  return (pass_beam(Boxes(*tree.nodes, octant), beam, t) & NodeChildren(*tree.nodes).slots()) != 0;
}

} // namespace
} // namespace packtrace::packed
