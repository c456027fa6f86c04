#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/trace/packed/kernels/kernel_types.h"
#include "runtime/trace/packed/kernels/ray_vectors.h"

/// Rays in the coordinates of one tree, with what box and triangle tests need of them.
namespace packtrace::packed {
namespace {

/// Rays that are traced together: as many as a word has bits.
constexpr uint32_t kGroup = 64;
/// Rays at a node that make it worth while to look at them together first.
constexpr uint32_t kLeastSideBySide = 12;

/// Box planes are moved outwards by this times M, the largest coordinate among the ray's origin and the tree. All
/// roundings in units of u = 2^-24, for a direction whose largest component is in [1, 2):
///  - A hit triangle's point lies off the ray: a vertex rounds to float (1 M), less the origin (2 M), sheared with a
///    rounded slope (2 M) in one rounding (4 M); it was an integer that rounded to float (1 M): at most 10 u M.
///    Of nearest hits t counts from the origin as it was before it was rounded (1 M).
///  - A plane's parameter p inv + b: the node's origin to float (1 M), its plane (1 M), inv's rounding (2 M, as b has
///  the
///    same one), b's product and pad (1 M each), the last rounding (2 M): 8 u M.
///  - A component below 2^-80 counts as 2^-80, whose inverse times 12 M is a float: within the reach of 6 M, next to
///    nothing.
/// So 20 u M suffice, and 24 are taken. In the tree over many placements M is less: see KernelScene.
constexpr float kBoxPad = 24.0f * 0x1p-24f;
constexpr float kSmallestDirection = 0x1p-80f;

/// Of t: what rounding t to a float in unit space takes at most (2^-24), and rounding it in a grid as well.
constexpr double kUnitRounding = 0x1p-23;

/// Rays as they come, in unit space.
struct alignas(64) UnitRays {
  float origin[3][kGroup], direction[3][kGroup], tnear[kGroup];
  float tmax[kGroup]; ///< inclusive: of a nearest hit, its t
  bool one_origin;    ///< of nearest hits: all start at one place, as camera rays do
};

struct Beam;

/// The box of all places where rays may hit something, for a node's boxes to be compared with: see reach.h.
struct Reach {
  float lo[3], hi[3];
  float flat;   ///< extents up to this count as none
  float pad[2]; ///< 0, and what boxes with an extent are nearer to where rays start than it says
  // Along the octant of set_octant():
  float sign[3];     ///< of directions
  float shift[3][2]; ///< rays reach a near plane p if sign p + the first <= 0, a far one if the second - sign p <= 0

  void set_octant(uint32_t octant) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool backward = ((octant >> axis) & 1u) != 0;
      sign[axis] = backward ? -1.0f : 1.0f;
      shift[axis][0] = backward ? lo[axis] : -hi[axis];
      shift[axis][1] = backward ? -hi[axis] : lo[axis];
    }
  }
};

/// What a triangle test needs of a ray, side by side: its origin along Woop's k, and its shears.
struct alignas(32) TestRay {
  float origin[3], begin, shear[3], end;
};
/// What rounding took from the origin, along Woop's k.
struct alignas(16) TestRest {
  float along[3], unused;
};

constexpr Reach kEverywhere{{-__builtin_inff(), -__builtin_inff(), -__builtin_inff()},
                            {__builtin_inff(), __builtin_inff(), __builtin_inff()},
                            0.0f,
                            {},
                            {},
                            {}};

/// What box tests need of rays. One array per value; those of rays that are not in use are not set.
struct alignas(64) BoxRays {
  static constexpr bool kTriangles = false, kSideBySide = false;
  float bias[3][kGroup][2]; ///< a near plane p is passed at p inverse + the first, a far one at p inverse - the second
  float limits[kGroup][2];  ///< hits lie above the first and not beyond - the second
  float inverse[3][kGroup]; ///< of the direction, never infinite
  uint64_t backward[3];     ///< rays along which x, y, z decrease, as bits
  // Of nearest hits only:
  double t_begin[kGroup]; ///< unit-space t = (t here + t_begin) t_scale
  double t_scale[kGroup]; ///< a power of two

  float unit_t(uint32_t i, float t) const { return static_cast<float>((double{t} + t_begin[i]) * t_scale[i]); }
  /// Not below any t that is `unit_t` in unit space, which several are where origins were moved.
  float t_of(uint32_t i, float unit_t) const {
    const double t = double{unit_t} / t_scale[i];
    return static_cast<float>(t - t_begin[i] + (t_begin[i] != 0.0 ? kUnitRounding * t : 0.0));
  }
  void set_tmax(uint32_t i, float t) { limits[i][1] = -t; }
  float tmax(uint32_t i) const { return -limits[i][1]; }
};

/// The same for many rays at a node, which are tested side by side.
struct alignas(64) SideBySideRays : BoxRays {
  static constexpr bool kSideBySide = true;
  float near_bias[3][kGroup], far_bias[3][kGroup]; ///< bias in arrays of their own, the second negated
  float begin[kGroup], end[kGroup];                ///< limits, the same
  Reach reach;

  void set_tmax(uint32_t i, float t) {
    BoxRays::set_tmax(i, t);
    end[i] = t;
  }
};

/// The same with what triangle tests need.
struct alignas(64) RayGroup : SideBySideRays {
  static constexpr bool kTriangles = true;
  float origin[3][kGroup];
  float shear[3][kGroup];   ///< Woop's S
  uint32_t axis[3][kGroup]; ///< Woop's k: x, y, z; z is the direction's largest component
  uint64_t major[3];        ///< rays whose k begins with x, y, z, as bits
  // Of nearest hits only:
  float rest[3][kGroup]; ///< what rounding to floats took from the origin
  Beam* beam = nullptr;  ///< that all its rays make, see beam.h
  // For leaves:
  TestRay tests[kGroup];
  TestRest rests[kGroup]; ///< of nearest hits only

  void set_tmax(uint32_t i, float t) {
    SideBySideRays::set_tmax(i, t);
    tests[i].end = t;
  }
};

/// Reads a block of rays.
/// @param numbers of the rays
[[gnu::always_inline]] inline void read_rays(const KernelRay* rays, const uint32_t (&numbers)[kBlock], uint32_t first,
                                             UnitRays& out) {
  static_assert(sizeof(KernelRay) == 32 && offsetof(KernelRay, tnear) == 12 && offsetof(KernelRay, direction) == 16 &&
                offsetof(KernelRay, tfar) == 28);
  const float* from[kBlock];
  for (uint32_t i = 0; i < kBlock; ++i) from[i] = reinterpret_cast<const float*>(rays + numbers[i]);
  Floats values[8];
  read_rows(from, values);
  transpose(values);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    write_block(&out.origin[axis][first], values[axis]);
    write_block(&out.direction[axis][first], values[4 + axis]);
  }
  write_block(&out.tnear[first], values[3]);
  write_block(&out.tmax[first], reinterpret_cast<Floats>(reinterpret_cast<Ints>(values[7]) - 1)); // the float below
}

/// Whether the first rays of a group do. Blocks are full: see read_rays().
inline bool start_at_one_place(const UnitRays& rays, uint32_t count) {
  Ints same = Ints{} - 1;
  for (uint32_t first = 0; first < count; first += kBlock)
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Floats origin;
      read_block(origin, &rays.origin[axis][first]);
      same &= origin == rays.origin[axis][0];
    }
  return lane_bits(same) == kBlockLanes;
}

/// A block of rays in a tree's grid as box and triangle tests take them.
struct RayBlock {
  Floats origin[3], direction[3], begin, end;
};

template <typename Group>
[[gnu::always_inline]] inline void set_boxes(const RayBlock& block, float pad_coordinate, uint32_t first,
                                             Group& group) {
  Floats reach = Floats{} + pad_coordinate;
  for (uint32_t axis = 0; axis < 3; ++axis) keep_larger(reach, magnitude(block.origin[axis]));
  write_pairs(&group.limits[first], block.begin, -block.end);
  if constexpr (Group::kSideBySide) {
    write_block(&group.begin[first], block.begin);
    write_block(&group.end[first], block.end);
  }
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const Floats d = block.direction[axis], size = magnitude(d);
    const Floats over = 1.0f / (size > kSmallestDirection ? size : Floats{} + kSmallestDirection);
    const Ints sign = reinterpret_cast<Ints>(d) & static_cast<int32_t>(0x80000000u);
    const Floats inverse = reinterpret_cast<Floats>(reinterpret_cast<Ints>(over) | sign);
    const Floats back = block.origin[axis] * inverse, away = kBoxPad * reach * over;
    write_block(&group.inverse[axis][first], inverse);
    write_pairs(&group.bias[axis][first], -back - away, back - away);
    if constexpr (Group::kSideBySide) {
      write_block(&group.near_bias[axis][first], -back - away);
      write_block(&group.far_bias[axis][first], away - back);
    }
    group.backward[axis] |= uint64_t{lane_bits(inverse < 0.0f)} << first;
  }
}

/// @tparam kNearest whether group.rest is set, which counts then
template <bool kNearest>
inline void set_shears(const RayBlock& block, uint32_t first, RayGroup& group) {
  for (uint32_t axis = 0; axis < 3; ++axis) write_block(&group.origin[axis][first], block.origin[axis]);
  const Floats x = block.direction[0], y = block.direction[1], z = block.direction[2];
  const Floats ax = magnitude(x), ay = magnitude(y), az = magnitude(z);
  const Ints by_z = (az >= ax) & (az >= ay), by_y = ~by_z & (ay >= ax);
  const auto along_k = [&](const Floats(&v)[3], Floats(&rows)[8]) {
    rows[0] = by_z ? v[0] : by_y ? v[2] : v[1];
    rows[1] = by_z ? v[1] : by_y ? v[0] : v[2];
    rows[2] = by_z ? v[2] : by_y ? v[1] : v[0];
  };
  const Ints zero{};
  group.major[0] |= uint64_t{lane_bits(by_z)} << first;
  group.major[1] |= uint64_t{lane_bits(~by_z & ~by_y)} << first;
  group.major[2] |= uint64_t{lane_bits(by_y)} << first;
  write_block(&group.axis[0][first], by_z ? zero : by_y ? zero + 2 : zero + 1);
  write_block(&group.axis[1][first], by_z ? zero + 1 : by_y ? zero : zero + 2);
  write_block(&group.axis[2][first], by_z ? zero + 2 : by_y ? zero + 1 : zero);
  Floats rows[8];
  along_k(block.direction, rows);
  const Floats along = rows[2];
  rows[4] = rows[0] / along, rows[5] = rows[1] / along, rows[6] = 1.0f / along;
  for (uint32_t axis = 0; axis < 3; ++axis) write_block(&group.shear[axis][first], rows[4 + axis]);
  along_k(block.origin, rows);
  rows[3] = block.begin, rows[7] = block.end;
  transpose(rows);
  write_rows(rows, &group.tests[first]);
  if constexpr (kNearest) {
    Floats rest[3], rests[8]{};
    for (uint32_t axis = 0; axis < 3; ++axis) read_block(rest[axis], &group.rest[axis][first]);
    along_k(rest, rests);
    transpose(rests);
    write_rows(rests, &group.rests[first]);
  }
}

} // namespace
} // namespace packtrace::packed
