#pragma once

#include <cstdint>

#include "runtime/trace/packed/kernel_types.h"

/// Rays in the coordinates of one tree, with what box and triangle tests need of them.
namespace packtrace::packed {
namespace {

/// Rays that are traced together: as many as a word has bits.
constexpr uint32_t kGroup = 64;

/// Box planes are moved outwards by this times M, the largest coordinate among the ray's origin and the tree. All
/// roundings in units of u = 2^-24, for a direction whose largest component is in [1, 2):
///  - A hit triangle's point lies off the ray: a vertex rounds to float (1 M), less the origin (2 M), sheared with a
///    rounded slope (2 M) in one rounding (4 M); it was an integer that rounded to float (1 M): at most 10 u M.
///  - A plane's parameter p inv + b: the node's origin to float (1 M), its plane (1 M), inv's rounding (2 M, as b has the
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

/// One array per value; those of rays that are not in use are not set.
struct alignas(64) RayGroup {
  float bias[3][kGroup][2]; ///< a near plane p is passed at p inverse + the first, a far one at p inverse - the second
  float limits[kGroup][2];  ///< hits lie above the first and not beyond - the second
  float inverse[3][kGroup]; ///< of the direction, never infinite
  float origin[3][kGroup];
  float shear[3][kGroup]; ///< Woop's S
  uint32_t axis[3][kGroup]; ///< Woop's k: x, y, z; z is the direction's largest component
  uint32_t octant[kGroup];  ///< bits 0, 1, 2: x, y, z decrease
  double t_begin[kGroup];   ///< unit-space t = (t here + t_begin) t_scale
  double t_scale[kGroup];   ///< a power of two

  void set_tmax(uint32_t i, float t) { limits[i][1] = -t; }
  float tmax(uint32_t i) const { return -limits[i][1]; }
};

inline uint64_t double_bits(double x) {
  uint64_t bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  return bits;
}

inline double bits_double(uint64_t bits) {
  double x;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

inline float next_below(float x) { // x > 0
  uint32_t bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  --bits;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

inline double larger(double a, double b) { return a > b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }

constexpr uint32_t kBlock = 8; ///< rays that are set up at once

/// A block of rays in a tree's grid, in doubles.
struct alignas(64) GridBlock {
  double origin[3][kBlock], direction[3][kBlock], largest[kBlock], away[kBlock], begin[kBlock], power[kBlock];
};

/// Moves rays into the grid and scales their directions so that the largest component is in [1, 2).
inline void move_block(const TracePlacement& placement, const UnitRays& from, uint32_t first, GridBlock& block) {
  const double* m = placement.grid_from_unit;
  for (uint32_t axis = 0; axis < 3; ++axis)
    for (uint32_t l = 0; l < kBlock; ++l) {
      const uint32_t i = first + l;
      block.direction[axis][l] = m[axis] * double{from.direction[0][i]} + m[3 + axis] * double{from.direction[1][i]} +
                                 m[6 + axis] * double{from.direction[2][i]};
      block.origin[axis][l] = m[axis] * double{from.origin[0][i]} + m[3 + axis] * double{from.origin[1][i]} +
                              m[6 + axis] * double{from.origin[2][i]} + m[9 + axis];
    }
  for (uint32_t l = 0; l < kBlock; ++l) {
    block.largest[l] = larger(larger(__builtin_fabs(block.direction[0][l]), __builtin_fabs(block.direction[1][l])),
                              __builtin_fabs(block.direction[2][l]));
    block.away[l] = larger(larger(__builtin_fabs(block.origin[0][l]), __builtin_fabs(block.origin[1][l])),
                           __builtin_fabs(block.origin[2][l]));
    block.begin[l] = 0.0;
  }
  for (uint32_t l = 0; l < kBlock; ++l) {
    uint64_t exponent = double_bits(block.largest[l]) >> 52;
    exponent = exponent < 523u ? 523u : exponent;
    exponent = exponent > 1523u ? 1523u : exponent;
    block.power[l] = bits_double(exponent << 52);
    const double scale = bits_double((2046u - exponent) << 52);
    block.direction[0][l] *= scale;
    block.direction[1][l] *= scale;
    block.direction[2][l] *= scale;
  }
}

/// Moves the origin of a ray that starts far from the tree to just before its box, where floats are finer. False where
/// the ray passes the box by.
inline bool approach(const TracePlacement& placement, double margin, GridBlock& block, uint32_t lane) {
  double begin = 0.0, end = 1e300;
  for (uint32_t i = 0; i < 3; ++i) {
    const double origin = block.origin[i][lane], direction = block.direction[i][lane];
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
  for (uint32_t i = 0; i < 3; ++i) block.origin[i][lane] += begin * block.direction[i][lane];
  block.begin[lane] = begin;
  return true;
}

/// The lanes that may hit something, as bits, once those far away have come near.
inline uint32_t usable_lanes(const TracePlacement& placement, float max_coordinate, GridBlock& block) {
  const double reach = kFar * double{max_coordinate};
  uint32_t usable = 0, far = 0;
  for (uint32_t l = 0; l < kBlock; ++l) {
    const bool sound = block.largest[l] > 0.0 && block.largest[l] < 1e300 && block.away[l] < 1e300;
    usable |= (sound ? 1u : 0u) << l;
    far |= (block.away[l] > reach ? 1u : 0u) << l;
  }
  for (far &= usable; far != 0; far &= far - 1) {
    const auto l = static_cast<uint32_t>(__builtin_ctz(far));
    if (!approach(placement, 0x1p-8 * double{max_coordinate}, block, l)) usable &= ~(1u << l);
  }
  return usable;
}

inline void set_boxes(const GridBlock& block, const UnitRays& from, float max_coordinate, uint32_t first,
                      RayGroup& group) {
  alignas(32) float pad[kBlock];
  for (uint32_t l = 0; l < kBlock; ++l) {
    const uint32_t i = first + l;
    float reach = max_coordinate;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      group.origin[axis][i] = static_cast<float>(block.origin[axis][l]);
      reach = larger(reach, __builtin_fabsf(group.origin[axis][i]));
    }
    pad[l] = kBoxPad * reach;
    group.octant[i] = 0;
    group.t_begin[i] = block.begin[l];
    group.t_scale[i] = 1.0 / block.power[l];
    group.limits[i][0] = static_cast<float>(double{from.tnear[i]} * block.power[l] - block.begin[l]);
    group.limits[i][1] = -static_cast<float>(double{from.tmax[i]} * block.power[l] - block.begin[l]);
  }
  for (uint32_t axis = 0; axis < 3; ++axis)
    for (uint32_t l = 0; l < kBlock; ++l) {
      const uint32_t i = first + l;
      const auto d = static_cast<float>(block.direction[axis][l]);
      const float size = larger(__builtin_fabsf(d), kSmallestDirection);
      const float inverse = __builtin_copysignf(1.0f / size, d);
      const float back = group.origin[axis][i] * inverse, away = pad[l] * __builtin_fabsf(inverse);
      group.inverse[axis][i] = inverse;
      group.bias[axis][i][0] = -back - away;
      group.bias[axis][i][1] = back - away;
      group.octant[i] |= (inverse < 0.0f ? 1u : 0u) << axis;
    }
}

inline void set_shears(const GridBlock& block, uint32_t first, RayGroup& group) {
  for (uint32_t l = 0; l < kBlock; ++l) {
    const uint32_t i = first + l;
    const auto x = static_cast<float>(block.direction[0][l]), y = static_cast<float>(block.direction[1][l]),
               z = static_cast<float>(block.direction[2][l]);
    const float ax = __builtin_fabsf(x), ay = __builtin_fabsf(y), az = __builtin_fabsf(z);
    const bool by_z = (az >= ax) & (az >= ay), by_y = !by_z & (ay >= ax);
    const float along = by_z ? z : by_y ? y : x;
    group.axis[0][i] = by_z ? 0u : by_y ? 2u : 1u;
    group.axis[1][i] = by_z ? 1u : by_y ? 0u : 2u;
    group.axis[2][i] = by_z ? 2u : by_y ? 1u : 0u;
    group.shear[0][i] = (by_z ? x : by_y ? z : y) / along;
    group.shear[1][i] = (by_z ? y : by_y ? x : z) / along;
    group.shear[2][i] = 1.0f / along;
  }
}

/// Moves rays into a tree's grid and sets them up. Returns those that may hit something.
/// @param rays as bits
inline uint64_t enter(const TracePlacement& placement, float max_coordinate, const UnitRays& from, uint64_t rays,
                      RayGroup& group) {
  uint64_t entered = 0;
  for (uint32_t first = 0; first < kGroup; first += kBlock) {
    if (((rays >> first) & 0xffu) == 0) continue;
    GridBlock block;
    move_block(placement, from, first, block);
    entered |= uint64_t{usable_lanes(placement, max_coordinate, block)} << first;
    set_boxes(block, from, max_coordinate, first, group);
    set_shears(block, first, group);
  }
  return entered & rays;
}

} // namespace
} // namespace packtrace::packed
