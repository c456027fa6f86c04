#pragma once

#include "runtime/trace/packed/kernels/group_bounds.h"

/// Transforms rays from unit space into the grid of a placed tree.
namespace packtrace::packed {
namespace {

/// An origin farther from the grid's zero than this many times the tree's largest coordinate is moved along its ray
/// towards the tree.
constexpr double kFar = 4.0;

/// Half a block of rays in a tree's grid, in doubles.
struct GridRays {
  Doubles origin[3], direction[3]; ///< the direction's largest component is in [1, 2)
  Doubles power, scale;            ///< power: grid t per unit-space t, a power of two; scale: 1 / power
  Doubles begin;                   ///< t by which the origins were moved along the rays
};

inline double larger(double a, double b) { return a > b ? a : b; }

/// Moves the origin of a ray that starts far from the tree to where it enters the tree's box plus `margin`; floats are
/// finer there. Returns false if the ray misses that box.
inline bool approach(const TracePlacement& placement, double margin, double (&origin)[3], const double (&direction)[3],
                     double& moved_by) {
  double begin = 0.0, end = 1e300;
  for (uint32_t i = 0; i < 3; ++i) {
    const double lo = placement.box_lo[i] - margin - origin[i], hi = placement.box_hi[i] + margin - origin[i];
    if (direction[i] == 0.0) {
      if (lo > 0.0 || hi < 0.0) return false;
      continue;
    }
    const double a = lo / direction[i], b = hi / direction[i];
    begin = larger(begin, a < b ? a : b);
    end = end < (a < b ? b : a) ? end : (a < b ? b : a);
  }
  if (begin > end) return false;
  for (uint32_t i = 0; i < 3; ++i) origin[i] += begin * direction[i];
  moved_by = begin;
  return true;
}

/// Does the same for several lanes. Returns the lanes whose rays meet the box, as a bit mask.
/// @param far bit mask of the lanes to move
inline uint32_t approach(const TracePlacement& placement, double margin, uint32_t far, GridRays& rays) {
  double origins[3][kDoubleLanes], directions[3][kDoubleLanes], begins[kDoubleLanes];
  for (uint32_t axis = 0; axis < 3; ++axis) {
    write_block(origins[axis], rays.origin[axis]);
    write_block(directions[axis], rays.direction[axis]);
  }
  write_block(begins, rays.begin);
  uint32_t near = 0;
  for (; far != 0; far &= far - 1) {
    const auto lane = static_cast<uint32_t>(__builtin_ctz(far));
    double origin[3] = {origins[0][lane], origins[1][lane], origins[2][lane]};
    const double direction[3] = {directions[0][lane], directions[1][lane], directions[2][lane]};
    if (!approach(placement, margin, origin, direction, begins[lane])) continue;
    for (uint32_t axis = 0; axis < 3; ++axis) origins[axis][lane] = origin[axis];
    near |= 1u << lane;
  }
  for (uint32_t axis = 0; axis < 3; ++axis) read_block(rays.origin[axis], origins[axis]);
  read_block(rays.begin, begins);
  return near;
}

/// Returns one component of vectors that the linear part of a placement's transform maps into the grid.
/// @param m TracePlacement::grid_from_unit
/// @tparam kAligned the grid's axes are those of unit space: the transform only scales and translates
/// @tparam Number double or Doubles
template <bool kAligned, typename Number>
[[gnu::always_inline]] inline Number turn(const double* m, uint32_t axis, const Number (&v)[3]) {
  if constexpr (kAligned) return m[4 * axis] * v[axis];
  return m[axis] * v[0] + m[3 + axis] * v[1] + m[6 + axis] * v[2];
}

/// Sets each lane of `most` to the larger of its value and |x|.
[[gnu::always_inline]] inline void keep_larger_magnitude(Doubles& most, const Doubles& x) {
  constexpr int64_t kMagnitude = 0x7fffffffffffffff;
  keep_larger(most, reinterpret_cast<Doubles>(reinterpret_cast<Longs>(x) & kMagnitude));
}

/// Transforms the directions of half a block of rays into the grid and scales them so that their largest components are
/// in [1, 2). Sets direction, power and scale of `out`. Returns the largest components before they were scaled.
template <bool kAligned>
[[gnu::always_inline]] inline Doubles move_directions(const TracePlacement& placement, const UnitRays& from,
                                                      uint32_t first, GridRays& out) {
  Doubles direction[3], largest{};
  for (uint32_t axis = 0; axis < 3; ++axis) direction[axis] = read_doubles(&from.direction[axis][first]);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    out.direction[axis] = turn<kAligned>(placement.grid_from_unit, axis, direction);
    keep_larger_magnitude(largest, out.direction[axis]);
  }
  constexpr int64_t kExponent = int64_t{2047} << 52, kMin = int64_t{523} << 52, kMax = int64_t{1523} << 52;
  const Doubles least = Doubles{} + __builtin_bit_cast(double, kMin),
                most = Doubles{} + __builtin_bit_cast(double, kMax);
  // Rounded down to a power of two; the limits 2^-500 and 2^500 keep its inverse one, too.
  Doubles power = reinterpret_cast<Doubles>(reinterpret_cast<Longs>(largest) & kExponent);
  power = power < least ? least : power;
  power = power > most ? most : power;
  out.power = power;
  out.scale = reinterpret_cast<Doubles>((int64_t{2046} << 52) - reinterpret_cast<Longs>(power));
  for (Doubles& component : out.direction) component = component * out.scale;
  return largest;
}

/// Transforms half a block of rays into the grid. Returns the lanes of `wanted` that may hit something: their
/// directions are nonzero, directions and origins are below 1e300 in magnitude, and origins far away have been moved to
/// the tree's box.
template <bool kAligned>
[[gnu::always_inline]] inline uint32_t move_rays(const TracePlacement& placement, float max_coordinate,
                                                 const UnitRays& from, uint32_t first, uint32_t wanted, GridRays& out) {
  Doubles origin[3], away{};
  for (uint32_t axis = 0; axis < 3; ++axis) origin[axis] = read_doubles(&from.origin[axis][first]);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    out.origin[axis] = turn<kAligned>(placement.grid_from_unit, axis, origin) + placement.grid_from_unit[9 + axis];
    keep_larger_magnitude(away, out.origin[axis]);
  }
  const Doubles largest = move_directions<kAligned>(placement, from, first, out);
  out.begin = Doubles{};
  const uint32_t usable = wanted & lanes_between(0.0, largest, 1e300) & lanes_between(-1.0, away, 1e300);
  const uint32_t far = usable & lanes_between(kFar * double{max_coordinate}, away, 1e300);
  if (far == 0) return usable;
  return (usable & ~far) | approach(placement, 0x1p-8 * double{max_coordinate}, far, out);
}

/// Half a block of rays, rounded to floats.
struct GridFloats {
  HalfFloats origin[3], direction[3], begin, end;
  HalfFloats rest[3]; ///< RayGroup::rest; set for nearest hits only
};

/// Rounds rays in the grid to floats.
/// @tparam kNearest as for move_block()
template <bool kNearest>
[[gnu::always_inline]] inline GridFloats to_floats(const GridRays& rays, const UnitRays& from, uint32_t first) {
  GridFloats out;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    out.origin[axis] = to_floats(rays.origin[axis]);
    out.direction[axis] = to_floats(rays.direction[axis]);
    if constexpr (kNearest) out.rest[axis] = to_floats(rays.origin[axis] - to_doubles(out.origin[axis]));
  }
  out.begin = to_floats(read_doubles(&from.tnear[first]) * rays.power - rays.begin);
  const Doubles end = read_doubles(&from.tmax[first]) * rays.power;
  if constexpr (kNearest) // Not rounded below the true end: see BoxRays::t_of().
    out.end = to_floats(end - rays.begin + (rays.begin != 0.0 ? kUnitRounding * end : Doubles{}));
  else
    out.end = to_floats(end - rays.begin);
  return out;
}

/// @tparam kRest whether `rest` is set
template <bool kRest>
inline RayBlock join(const GridFloats& low, const GridFloats& high) {
  RayBlock out;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    out.origin[axis] = join(low.origin[axis], high.origin[axis]);
    out.direction[axis] = join(low.direction[axis], high.direction[axis]);
    if constexpr (kRest) out.rest[axis] = join(low.rest[axis], high.rest[axis]);
  }
  out.begin = join(low.begin, high.begin);
  out.end = join(low.end, high.end);
  return out;
}

/// Transforms a block of rays into a tree's grid. Returns the lanes of `wanted` that may hit something.
/// @tparam kNearest whether the query is for nearest hits; it then also keeps the rounding errors of the origins and
/// the map from grid t to unit-space t
template <bool kAligned, bool kNearest, typename Group>
inline uint32_t move_block(const TracePlacement& placement, float max_coordinate, const UnitRays& from, uint32_t first,
                           uint32_t wanted, RayBlock& out, Group& group) {
  uint32_t usable = 0;
  const auto half = [&](uint32_t at) {
    GridRays rays;
    usable |= move_rays<kAligned>(placement, max_coordinate, from, first + at, wanted >> at, rays) << at;
    const GridFloats rounded = to_floats<kNearest>(rays, from, first + at);
    if constexpr (kNearest) {
      write_block(&group.t_begin[first + at], rays.begin);
      write_block(&group.t_scale[first + at], rays.scale);
    }
    return rounded;
  };
  const GridFloats low = half(0), high = half(kDoubleLanes);
  constexpr bool kRest = kNearest && Group::kTriangles;
  out = join<kRest>(low, high);
  return usable & wanted;
}

/// Does the same in floats alone, for a grid that is unit space itself. Returns false if a wanted ray starts too far
/// away or has a direction of extreme length; the caller then uses move_block().
/// @param wanted bit mask of the lanes that must be valid
template <bool kNearest>
inline bool unit_block(const UnitRays& from, uint32_t first, uint32_t wanted, float max_coordinate, RayBlock& out,
                       BoxRays& group) {
  Floats largest{}, away{};
  for (uint32_t axis = 0; axis < 3; ++axis) {
    read_block(out.origin[axis], &from.origin[axis][first]);
    read_block(out.direction[axis], &from.direction[axis][first]);
    keep_larger(largest, magnitude(out.direction[axis]));
    keep_larger(away, magnitude(out.origin[axis]));
  }
  const Ints usable =
      (largest > 0x1p-100f) & (largest < 0x1p100f) & (away <= static_cast<float>(kFar) * max_coordinate);
  if ((lane_bits(usable) & wanted) != wanted) return false;
  const Ints power = reinterpret_cast<Ints>(largest) & 0x7f800000; // down to a power of two
  const Floats scale = reinterpret_cast<Floats>((254 << 23) - power);
  for (Floats& component : out.direction) component = component * scale;
  Floats tnear, tmax;
  read_block(tnear, &from.tnear[first]);
  read_block(tmax, &from.tmax[first]);
  out.begin = tnear * reinterpret_cast<Floats>(power);
  out.end = tmax * reinterpret_cast<Floats>(power);
  if constexpr (kNearest) {
    float scales[kBlock];
    write_block(scales, scale);
    for (uint32_t at = 0; at < kBlock; at += kDoubleLanes) {
      write_block(&group.t_begin[first + at], Doubles{});
      write_block(&group.t_scale[first + at], read_doubles(scales + at));
    }
  }
  return true;
}

/// Transforms rays into a tree's grid and prepares them for box and triangle tests. Returns the rays that may hit
/// something, as a bit mask.
/// @tparam kNearest as for move_block()
/// @tparam kForBeam leaves `limits`, `bias`, `tests` and `rests` unset; the caller then calls make_beam(), and
/// fill_records() if that returns false
/// @param pad_coordinate coordinate that the pad of box planes is computed from; a ray's own origin counts instead if
/// its largest coordinate is larger
/// @param rays bit mask of the rays to transform
/// @param group a RayGroup, or BoxRays or SideBySideRays if the grid is unit space
template <bool kNearest, bool kForBeam = false, typename Group>
inline uint64_t enter(const TracePlacement& placement, float max_coordinate, float pad_coordinate, const UnitRays& from,
                      uint64_t rays, Group& group) {
  uint64_t entered = 0;
  const bool find_reach = Group::kSideBySide &&
                          static_cast<uint32_t>(__builtin_popcountll(rays)) >= kMinSideBySideRays &&
                          !(kNearest && from.one_origin);
  GroupBoundsFinder reach(max_coordinate);
  for (uint64_t& backward : group.backward) backward = 0;
  if constexpr (Group::kTriangles)
    for (uint64_t& major : group.major) major = 0;
  for (uint32_t first = 0; first < kGroup; first += kBlock) {
    const auto wanted = static_cast<uint32_t>(rays >> first) & kBlockLanes;
    if (wanted == 0) continue;
    RayBlock block;
    uint32_t usable = wanted;
    if (Group::kTriangles || !unit_block<kNearest>(from, first, wanted, max_coordinate, block, group))
      usable = placement.aligned != 0
                   ? move_block<true, kNearest>(placement, max_coordinate, from, first, wanted, block, group)
                   : move_block<false, kNearest>(placement, max_coordinate, from, first, wanted, block, group);
    entered |= uint64_t{usable} << first;
    set_boxes<kForBeam>(block, pad_coordinate, first, group);
    if constexpr (Group::kSideBySide)
      if (find_reach) reach.template add<kNearest>(block, usable);
    if constexpr (Group::kTriangles) set_shears<kNearest, kForBeam>(block, first, group);
  }
  if constexpr (Group::kSideBySide) {
    if (find_reach)
      reach.read(Group::kTriangles ? 0.0f : kUnitFlat * max_coordinate, group.reach);
    else
      group.reach = kUnboundedGroup;
  }
  return entered;
}

} // namespace
} // namespace packtrace::packed
