#pragma once

#include "runtime/trace/packed/kernels/beam.h"
#include "runtime/trace/packed/kernels/enter.h"
#include "runtime/trace/packed/kernels/prefetch.h"

/// Reads and transforms runs: kGroup rays that follow each other and have one origin, tnear and octant, such as camera
/// rays of neighbouring pixels. What their origin determines is computed once. All values are those of read_rays() and
/// enter(), bit for bit.
namespace packtrace::packed {
namespace {

/// Transposes the second halves of kBlock rays that follow each other: x, y and z of the direction, and tfar.
/// @param rows the rays' records, in the order of memory
[[gnu::always_inline]] inline void transpose_directions(const Floats (&rows)[8], Floats (&out)[4]) {
#if defined(__AVX512F__)
  Floats four[4]; // x, y, z and tfar of rays 4 i to 4 i + 3
  for (uint32_t i = 0; i < 4; ++i)
    four[i] = __builtin_shufflevector(rows[2 * i], rows[2 * i + 1], 4, 12, 20, 28, 5, 13, 21, 29, 6, 14, 22, 30, 7, 15,
                                      23, 31);
  Floats xy[2], zt[2]; // of rays 8 i to 8 i + 7
  for (uint32_t i = 0; i < 2; ++i) {
    const Floats a = four[2 * i], b = four[2 * i + 1];
    xy[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 16, 17, 18, 19, 4, 5, 6, 7, 20, 21, 22, 23);
    zt[i] = __builtin_shufflevector(a, b, 8, 9, 10, 11, 24, 25, 26, 27, 12, 13, 14, 15, 28, 29, 30, 31);
  }
  const auto lows = [](const Floats(&v)[2]) {
    return __builtin_shufflevector(v[0], v[1], 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23);
  };
  const auto highs = [](const Floats(&v)[2]) {
    return __builtin_shufflevector(v[0], v[1], 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31);
  };
#else
  Floats two[4]; // of rays i and i + 4
  for (uint32_t i = 0; i < 4; ++i) two[i] = __builtin_shufflevector(rows[i], rows[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  Floats xy[2], zt[2]; // of rays 2 i, 2 i + 1, 2 i + 4 and 2 i + 5
  for (uint32_t i = 0; i < 2; ++i) {
    const Floats a = two[2 * i], b = two[2 * i + 1];
    xy[i] = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
    zt[i] = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  }
  const auto lows = [](const Floats(&v)[2]) { return __builtin_shufflevector(v[0], v[1], 0, 1, 8, 9, 4, 5, 12, 13); };
  const auto highs = [](const Floats(&v)[2]) {
    return __builtin_shufflevector(v[0], v[1], 2, 3, 10, 11, 6, 7, 14, 15);
  };
#endif
  out[0] = lows(xy), out[1] = highs(xy), out[2] = lows(zt), out[3] = highs(zt);
}

/// Reads kGroup rays. Returns false unless all bits of their origins and of tnear agree, their directions have one
/// octant, and their ranges of t are not empty. Prefetches the next kGroup rays.
/// @param hits where the rays' hits will be written; prefetched
inline bool read_run(const KernelRay* rays, const KernelHit* hits, UnitRays& out) {
  constexpr uint32_t kRayFloats = sizeof(KernelRay) / sizeof(float), kRaysPerRow = kBlock / kRayFloats;
  constexpr uint32_t kStarts = kRaysPerRow == 2 ? 0x0f0fu : 0x0fu; // the lanes of origins and tnear in a row
  const auto* const from = reinterpret_cast<const float*>(rays);
  Floats first_row;
  if constexpr (kRaysPerRow == 2) {
    HalfFloats first_ray;
    read_block(first_ray, from);
    first_row = join(first_ray, first_ray);
  } else {
    read_block(first_row, from);
  }
  const Ints all = Ints{} - 1;
  Ints differences{}, ranges = all, every_direction[3] = {all, all, all}, any_direction[3]{};
  for (uint32_t first = 0; first < kGroup; first += kBlock) {
    prefetch(rays, (kGroup + first) * sizeof *rays, kBlock * sizeof *rays);
    prefetch<true>(hits, first * sizeof *hits, kBlock * sizeof *hits);
    Floats rows[8], values[4];
    for (uint32_t i = 0; i < 8; ++i) {
      read_block(rows[i], from + kRayFloats * first + kBlock * i);
      differences |= reinterpret_cast<Ints>(rows[i]) ^ reinterpret_cast<Ints>(first_row);
    }
    transpose_directions(rows, values);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      write_block(&out.origin[axis][first], Floats{} + rays->origin[axis]);
      write_block(&out.direction[axis][first], values[axis]);
      every_direction[axis] &= reinterpret_cast<Ints>(values[axis]);
      any_direction[axis] |= reinterpret_cast<Ints>(values[axis]);
    }
    const Floats end = before_tfar(values[3]);
    write_block(&out.tnear[first], Floats{} + rays->tnear);
    write_block(&out.tmax[first], end);
    ranges &= end >= rays->tnear;
  }
  for (uint32_t axis = 0; axis < 3; ++axis) // The sign bit decides, as in Traversal::octant_of(): -0 is negative.
    if (lane_bits(every_direction[axis] < 0) != kBlockLanes && lane_bits(any_direction[axis] < 0) != 0) return false;
  return (lane_bits(differences != 0) & kStarts) == 0 && lane_bits(ranges) == kBlockLanes && rays->tnear >= 0.0f;
}

/// The common origin of a run in a tree's grid.
struct RunOrigin {
  float rounded[3], rest[3]; ///< rest: exact minus rounded
};

/// Transforms the origin of a run into the grid. Returns false if it is so far away that it must be moved along the
/// rays.
template <bool kAligned>
inline bool move_origin(const TracePlacement& placement, float max_coordinate, const UnitRays& from, RunOrigin& out) {
  const double origin[3] = {from.origin[0][0], from.origin[1][0], from.origin[2][0]};
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const double exact = turn<kAligned>(placement.grid_from_unit, axis, origin) + placement.grid_from_unit[9 + axis];
    if (!(__builtin_fabs(exact) <= kFar * double{max_coordinate})) return false;
    out.rounded[axis] = static_cast<float>(exact);
    out.rest[axis] = static_cast<float>(exact - double{out.rounded[axis]});
  }
  return true;
}

/// Transforms the directions and ranges of t of a block of a run, and writes the scales of t. Returns false unless grid
/// t is a multiple of unit-space t by a power of two in (2^-60, 2^60) for each ray.
template <bool kAligned>
[[gnu::always_inline]] inline bool move_run_block(const TracePlacement& placement, const UnitRays& from, uint32_t first,
                                                  RayBlock& out, RayGroup& group, Beam& beam) {
  uint32_t plain = (1u << kDoubleLanes) - 1;
  const auto half = [&](uint32_t at) {
    GridRays rays;
    move_directions<kAligned>(placement, from, at, rays);
    plain &= lanes_between(kLeastPlainScale, rays.scale, kMostPlainScale);
    write_block(&group.t_begin[at], Doubles{});
    write_block(&group.t_scale[at], rays.scale);
    write_block(&beam.unit_scale[at], to_floats(rays.scale));
    write_block(&beam.grid_scale[at], to_floats(rays.power));
    GridFloats rounded;
    for (uint32_t axis = 0; axis < 3; ++axis) rounded.direction[axis] = to_floats(rays.direction[axis]);
    return rounded;
  };
  const GridFloats low = half(first), high = half(first + kDoubleLanes);
  for (uint32_t axis = 0; axis < 3; ++axis) out.direction[axis] = join(low.direction[axis], high.direction[axis]);
  // Products with powers of two are rounded as in to_floats().
  Floats power, tnear, tmax;
  read_block(power, &beam.grid_scale[first]);
  read_block(tnear, &from.tnear[first]);
  read_block(tmax, &from.tmax[first]);
  out.begin = tnear * power, out.end = tmax * power;
  return plain == (1u << kDoubleLanes) - 1;
}

/// Does for a run what enter() and make_beam() do. Returns false if the rays have different octants in the grid, are
/// scaled unusually or start far away; the contents of `group` and `beam` are then unspecified, and enter() must be
/// used.
template <bool kAligned>
inline bool enter_run(const TracePlacement& placement, float max_coordinate, float pad_coordinate, const UnitRays& from,
                      RayGroup& group, Beam& beam) {
  RunOrigin origin;
  if (!move_origin<kAligned>(placement, max_coordinate, from, origin)) return false;
  for (uint64_t& backward : group.backward) backward = 0;
  for (uint64_t& major : group.major) major = 0;
  RayBlock block;
  for (uint32_t axis = 0; axis < 3; ++axis)
    block.origin[axis] = Floats{} + origin.rounded[axis], block.rest[axis] = Floats{} + origin.rest[axis];
  for (uint32_t first = 0; first < kGroup; first += kBlock) {
    if (!move_run_block<kAligned>(placement, from, first, block, group, beam)) return false;
    set_boxes<true>(block, pad_coordinate, first, group);
    set_shears<true, true>(block, first, group);
  }
  for (const uint64_t backward : group.backward)
    if (backward != 0 && backward != ~uint64_t{0}) return false;
  group.reach = kUnboundedGroup;
  beam.plain = true;
  set_bounds(group, pad_coordinate, 0, beam);
  return true;
}

inline bool enter_run(const TracePlacement& placement, float max_coordinate, float pad_coordinate, const UnitRays& from,
                      RayGroup& group, Beam& beam) {
  return placement.aligned != 0 ? enter_run<true>(placement, max_coordinate, pad_coordinate, from, group, beam)
                                : enter_run<false>(placement, max_coordinate, pad_coordinate, from, group, beam);
}

} // namespace
} // namespace packtrace::packed
