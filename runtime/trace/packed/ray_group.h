#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/trace/packed/kernel_types.h"
#include "runtime/trace/packed/ray_vectors.h"

/// Rays in the coordinates of one tree, with what box and triangle tests need of them.
namespace packtrace::packed {
namespace {

/// Rays that are traced together: as many as a word has bits.
constexpr uint32_t kGroup = 64;

/// Box planes are moved outwards by this times M, the largest coordinate among the ray's origin and the tree. All
/// roundings in units of u = 2^-24, for a direction whose largest component is in [1, 2):
///  - A hit triangle's point lies off the ray: a vertex rounds to float (1 M), less the origin (2 M), sheared with a
///    rounded slope (2 M) in one rounding (4 M); it was an integer that rounded to float (1 M): at most 10 u M.
///  - A plane's parameter p inv + b: the node's origin to float (1 M), its plane (1 M), inv's rounding (2 M, as b has
///  the
///    same one), b's product and pad (1 M each), the last rounding (2 M): 8 u M.
///  - A component below 2^-40 counts as 2^-40: within the reach of 4 M, 2^-38 M.
/// So 19 u M suffice, and 24 are taken.
constexpr float kBoxPad = 24.0f * 0x1p-24f;
constexpr float kSmallestDirection = 0x1p-40f;
/// Origins farther from the tree's zero than its largest coordinate times this are moved along the ray.
constexpr double kFar = 4.0;

/// Rays as they come, in unit space.
struct alignas(64) UnitRays {
  float origin[3][kGroup], direction[3][kGroup], tnear[kGroup];
  float tmax[kGroup]; ///< inclusive: of a nearest hit, its t
};

struct Beam;

/// What a triangle test needs of a ray, side by side: its origin along Woop's k, and its shears.
struct alignas(32) TestRay {
  float origin[3], begin, shear[3], end;
};

/// One array per value; those of rays that are not in use are not set.
struct alignas(64) RayGroup {
  float bias[3][kGroup][2]; ///< a near plane p is passed at p inverse + the first, a far one at p inverse - the second
  float limits[kGroup][2];  ///< hits lie above the first and not beyond - the second
  float begin[kGroup], end[kGroup]; ///< the same in arrays of their own
  float inverse[3][kGroup];         ///< of the direction, never infinite
  float origin[3][kGroup];
  float shear[3][kGroup];   ///< Woop's S
  uint32_t axis[3][kGroup]; ///< Woop's k: x, y, z; z is the direction's largest component
  uint64_t major[3];        ///< rays whose k begins with x, y, z, as bits
  uint64_t backward[3];     ///< rays along which x, y, z decrease, as bits
  double t_begin[kGroup];   ///< unit-space t = (t here + t_begin) t_scale
  double t_scale[kGroup];   ///< a power of two
  TestRay tests[kGroup];
  Beam* beam = nullptr; ///< that all its rays make, see beam.h

  void set_tmax(uint32_t i, float t) {
    limits[i][1] = -t;
    end[i] = t;
    tests[i].end = t;
  }
  float tmax(uint32_t i) const { return end[i]; }
};

/// Reads a block of rays.
/// @param numbers of the rays
inline void read_rays(const KernelRay* rays, const uint32_t (&numbers)[kBlock], uint32_t first, UnitRays& out) {
  static_assert(sizeof(KernelRay) == sizeof(Floats) && offsetof(KernelRay, tnear) == 12 &&
                offsetof(KernelRay, direction) == 16 && offsetof(KernelRay, tfar) == 28);
  Floats values[kBlock];
  for (uint32_t i = 0; i < kBlock; ++i) read_block(values[i], reinterpret_cast<const float*>(rays + numbers[i]));
  transpose(values);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    write_block(&out.origin[axis][first], values[axis]);
    write_block(&out.direction[axis][first], values[4 + axis]);
  }
  write_block(&out.tnear[first], values[3]);
  write_block(&out.tmax[first], reinterpret_cast<Floats>(reinterpret_cast<Ints>(values[7]) - 1)); // the float below
}

/// A block of rays in a tree's grid, in doubles.
struct GridBlock {
  Doubles origin[3], direction[3];
  Doubles power, scale; ///< t here for one in unit space, and 1 / that
  Doubles begin;        ///< that origins were moved by
};

/// Moves rays into the grid and scales their directions so that the largest component is in [1, 2). Returns the lanes
/// that have a direction and coordinates of any use.
inline uint32_t move_block(const TracePlacement& placement, const UnitRays& from, uint32_t first, GridBlock& block,
                           Doubles& away) {
  constexpr int64_t kMagnitude = 0x7fffffffffffffff;
  const auto keep_magnitude = [](Doubles& most, const Doubles& x) {
    for (uint32_t i = 0; i < kDoubleParts; ++i)
      keep_larger(most.part[i], reinterpret_cast<DoublePart>(reinterpret_cast<LongPart>(x.part[i]) & kMagnitude));
  };
  const double* m = placement.grid_from_unit;
  Doubles origin[3], direction[3], largest{};
  away = Doubles{};
  for (uint32_t axis = 0; axis < 3; ++axis) {
    origin[axis] = read_doubles(&from.origin[axis][first]);
    direction[axis] = read_doubles(&from.direction[axis][first]);
  }
  for (uint32_t axis = 0; axis < 3; ++axis) {
    block.direction[axis] = m[axis] * direction[0] + m[3 + axis] * direction[1] + m[6 + axis] * direction[2];
    block.origin[axis] = m[axis] * origin[0] + m[3 + axis] * origin[1] + m[6 + axis] * origin[2] + m[9 + axis];
    keep_magnitude(largest, block.direction[axis]);
    keep_magnitude(away, block.origin[axis]);
  }
  for (uint32_t i = 0; i < kDoubleParts; ++i) { // down to a power of two, whose inverse is one, too
    constexpr int64_t kExponent = int64_t{2047} << 52, kLeast = int64_t{523} << 52, kMost = int64_t{1523} << 52;
    DoublePart power = reinterpret_cast<DoublePart>(reinterpret_cast<LongPart>(largest.part[i]) & kExponent);
    const DoublePart least = DoublePart{} + __builtin_bit_cast(double, kLeast),
                     most = DoublePart{} + __builtin_bit_cast(double, kMost);
    power = power < least ? least : power;
    power = power > most ? most : power;
    block.power.part[i] = power;
    block.scale.part[i] = reinterpret_cast<DoublePart>((int64_t{2046} << 52) - reinterpret_cast<LongPart>(power));
  }
  for (Doubles& component : block.direction) component = component * block.scale;
  block.begin = Doubles{};
  return lanes_between(0.0, largest, 1e300) & lanes_between(-1.0, away, 1e300);
}

inline double larger(double a, double b) { return a > b ? a : b; }

/// Moves the origin of a ray that starts far from the tree to just before its box, where floats are finer. False where
/// the ray passes the box by.
inline bool approach(const TracePlacement& placement, double margin, GridBlock& block, uint32_t lane) {
  double begin = 0.0, end = 1e300;
  for (uint32_t i = 0; i < 3; ++i) {
    const double origin = block.origin[i].get(lane), direction = block.direction[i].get(lane);
    const double lo = placement.box_lo[i] - margin - origin, hi = placement.box_hi[i] + margin - origin;
    if (direction == 0.0) {
      if (lo > 0.0 || hi < 0.0) return false;
      continue;
    }
    const double a = lo / direction, b = hi / direction;
    begin = larger(begin, a < b ? a : b);
    end = end < (a < b ? b : a) ? end : (a < b ? b : a);
  }
  if (begin > end) return false;
  for (uint32_t i = 0; i < 3; ++i)
    block.origin[i].set(lane, block.origin[i].get(lane) + begin * block.direction[i].get(lane));
  block.begin.set(lane, begin);
  return true;
}

inline void write_pairs(float (*out)[2], const Floats& a, const Floats& b) {
  write_block(&out[0][0], __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11));
  write_block(&out[4][0], __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15));
}

inline Floats magnitude(const Floats& x) { return reinterpret_cast<Floats>(reinterpret_cast<Ints>(x) & 0x7fffffff); }

/// A block of rays in a tree's grid as box and triangle tests take them.
struct RayBlock {
  Floats origin[3], direction[3], begin, end;
};

inline RayBlock ray_block(const GridBlock& block, const UnitRays& from, uint32_t first) {
  RayBlock out;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    out.origin[axis] = to_floats(block.origin[axis]);
    out.direction[axis] = to_floats(block.direction[axis]);
  }
  out.begin = to_floats(read_doubles(&from.tnear[first]) * block.power - block.begin);
  out.end = to_floats(read_doubles(&from.tmax[first]) * block.power - block.begin);
  return out;
}

/// What the two above make of rays where the grid is unit space, without doubles. False where it cannot, as origins are
/// far away or directions of extreme lengths.
/// @param wanted lanes that matter
inline bool unit_block(const UnitRays& from, uint32_t first, uint32_t wanted, float max_coordinate, RayBlock& out,
                       Floats& scale) {
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
  scale = reinterpret_cast<Floats>((254 << 23) - power);
  for (Floats& component : out.direction) component = component * scale;
  Floats tnear, tmax;
  read_block(tnear, &from.tnear[first]);
  read_block(tmax, &from.tmax[first]);
  out.begin = tnear * reinterpret_cast<Floats>(power);
  out.end = tmax * reinterpret_cast<Floats>(power);
  return true;
}

inline void set_boxes(const RayBlock& block, float max_coordinate, uint32_t first, RayGroup& group) {
  Floats reach = Floats{} + max_coordinate;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    keep_larger(reach, magnitude(block.origin[axis]));
    write_block(&group.origin[axis][first], block.origin[axis]);
  }
  write_pairs(&group.limits[first], block.begin, -block.end);
  write_block(&group.begin[first], block.begin);
  write_block(&group.end[first], block.end);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const Floats d = block.direction[axis], size = magnitude(d);
    const Floats over = 1.0f / (size > kSmallestDirection ? size : Floats{} + kSmallestDirection);
    const Ints sign = reinterpret_cast<Ints>(d) & static_cast<int32_t>(0x80000000u);
    const Floats inverse = reinterpret_cast<Floats>(reinterpret_cast<Ints>(over) | sign);
    const Floats back = block.origin[axis] * inverse, away = kBoxPad * reach * over;
    write_block(&group.inverse[axis][first], inverse);
    write_pairs(&group.bias[axis][first], -back - away, back - away);
    group.backward[axis] |= uint64_t{lane_bits(inverse < 0.0f)} << first;
  }
}

inline void set_shears(const RayBlock& block, uint32_t first, RayGroup& group) {
  const Floats x = block.direction[0], y = block.direction[1], z = block.direction[2];
  const Floats ax = magnitude(x), ay = magnitude(y), az = magnitude(z);
  const Ints by_z = (az >= ax) & (az >= ay), by_y = ~by_z & (ay >= ax);
  const Floats along = by_z ? z : by_y ? y : x;
  const Ints zero{};
  group.major[0] |= uint64_t{lane_bits(by_z)} << first;
  group.major[1] |= uint64_t{lane_bits(~by_z & ~by_y)} << first;
  group.major[2] |= uint64_t{lane_bits(by_y)} << first;
  write_block(&group.axis[0][first], by_z ? zero : by_y ? zero + 2 : zero + 1);
  write_block(&group.axis[1][first], by_z ? zero + 1 : by_y ? zero : zero + 2);
  write_block(&group.axis[2][first], by_z ? zero + 2 : by_y ? zero + 1 : zero);
  write_block(&group.shear[0][first], (by_z ? x : by_y ? z : y) / along);
  write_block(&group.shear[1][first], (by_z ? y : by_y ? x : z) / along);
  write_block(&group.shear[2][first], 1.0f / along);
}

/// Moves rays into a tree's grid and sets them up. Returns those that may hit something.
/// @tparam kTriangles whether rays meet triangles there; else the grid is unit space
/// @param rays as bits
template <bool kTriangles>
inline uint64_t enter(const TracePlacement& placement, float max_coordinate, const UnitRays& from, uint64_t rays,
                      RayGroup& group) {
  uint64_t entered = 0;
  for (uint64_t& backward : group.backward) backward = 0;
  for (uint64_t& major : group.major) major = 0;
  for (uint32_t first = 0; first < kGroup; first += kBlock) {
    const auto wanted = static_cast<uint32_t>(rays >> first) & 0xffu;
    if (wanted == 0) continue;
    RayBlock rays_here;
    if (Floats scale; !kTriangles && unit_block(from, first, wanted, max_coordinate, rays_here, scale)) {
      entered |= uint64_t{wanted} << first;
      write_block(&group.t_begin[first], Doubles{});
      write_block(&group.t_scale[first], to_doubles(scale));
      set_boxes(rays_here, max_coordinate, first, group);
      continue;
    }
    GridBlock block;
    Doubles away;
    uint32_t usable = wanted & move_block(placement, from, first, block, away);
    for (uint32_t far = usable & lanes_between(kFar * double{max_coordinate}, away, 1e300); far != 0; far &= far - 1) {
      const auto lane = static_cast<uint32_t>(__builtin_ctz(far));
      if (!approach(placement, 0x1p-8 * double{max_coordinate}, block, lane)) usable &= ~(1u << lane);
    }
    entered |= uint64_t{usable} << first;
    write_block(&group.t_begin[first], block.begin);
    write_block(&group.t_scale[first], block.scale);
    rays_here = ray_block(block, from, first);
    set_boxes(rays_here, max_coordinate, first, group);
    if constexpr (kTriangles) set_shears(rays_here, first, group);
  }
  return entered;
}

} // namespace
} // namespace packtrace::packed
