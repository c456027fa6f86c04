#pragma once

#include <cstdint>

#include "runtime/trace/packed/kernel_types.h"

/// A ray in the coordinates of one tree, with what box and triangle tests need of it.
namespace packtrace::packed {
namespace {

/// Box planes are moved outwards by this times M, the largest coordinate among the ray's origin and the tree. All
/// roundings in units of u = 2^-24, for a direction whose largest component is in [1, 2):
///  - A hit triangle's point lies off the ray: a vertex rounds to float (1 M), less the origin (2 M), sheared with a
///    rounded slope (2 M) in one rounding (4 M); it was an integer that rounded to float (1 M): at most 10 u M.
///  - A plane's parameter q s + b, with b = (node - origin) inv: node to float (1 M), the difference (2 M), inv's
///    rounding (in both products 2 M together), the product (2 M), the pad's own sum (2 M), the last rounding (2 M): 11
///    u M.
///  - A component below 2^-40 counts as 2^-40: within the reach of 4 M, 2^-38 M.
/// So 22 u M suffice, and 24 are taken.
constexpr float kBoxPad = 24.0f * 0x1p-24f;
constexpr float kSmallestDirection = 0x1p-40f;

struct GridRay {
  float origin[3];
  float inverse[3];     ///< of the direction, never infinite
  float pad[3];         ///< kBoxPad M |inverse|
  uint32_t near_at[3];  ///< where a node's nearer planes begin, from lo on; the farther ones are at kBoundBytes less
  uint32_t kx, ky, kz;  ///< kz: of the direction's largest component
  float sx, sy, sz;     ///< shears x and y, scales z
  float tnear;          ///< hits lie above,
  float tmax;           ///< and not beyond: of a nearest hit, its t
  double t_begin;       ///< t = (t here + t_begin) t_scale
  double t_scale;       ///< a power of two
  float box_pad;        ///< kBoxPad M
};

constexpr uint32_t kBoundBytes = 24; ///< of lo, and of hi

inline float next_below(float x) { // x > 0
  uint32_t bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  --bits;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

/// 2^e of |x| in [2^e, 2^(e+1)), or of the nearest e within +-500.
inline double power_below(double x) {
  uint64_t bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  uint64_t exponent = (bits >> 52) & 0x7ffu;
  exponent = exponent < 523u ? 523u : exponent > 1523u ? 1523u : exponent;
  bits = exponent << 52;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

/// Moves the origin of a ray that starts far from the tree to just before its box, where floats are finer. False where
/// the ray passes the box by.
inline bool approach(const TracePlacement& placement, double margin, double origin[3], const double direction[3],
                     double& t_begin) {
  double begin = 0.0, end = 1e300;
  for (uint32_t i = 0; i < 3; ++i) {
    const double lo = placement.box_lo[i] - margin - origin[i], hi = placement.box_hi[i] + margin - origin[i];
    if (direction[i] == 0.0) {
      if (lo > 0.0 || hi < 0.0) return false;
      continue;
    }
    const double a = lo / direction[i], b = hi / direction[i];
    const double near = a < b ? a : b, far = a < b ? b : a;
    begin = near > begin ? near : begin;
    end = far < end ? far : end;
  }
  if (begin > end) return false;
  for (uint32_t i = 0; i < 3; ++i) origin[i] += begin * direction[i];
  t_begin = begin;
  return true;
}

/// Sets the ray up for box and triangle tests, all but tnear, tmax and t's relation to another space.
inline void aim(GridRay& ray, const double origin[3], const double direction[3], float max_coordinate) {
  float d[3], reach = max_coordinate;
  for (uint32_t i = 0; i < 3; ++i) {
    ray.origin[i] = static_cast<float>(origin[i]);
    d[i] = static_cast<float>(direction[i]);
    const float far = __builtin_fabsf(ray.origin[i]);
    reach = far > reach ? far : reach;
  }
  ray.box_pad = kBoxPad * reach;
  for (uint32_t i = 0; i < 3; ++i) {
    const float component =
        __builtin_fabsf(d[i]) < kSmallestDirection ? __builtin_copysignf(kSmallestDirection, d[i]) : d[i];
    ray.inverse[i] = 1.0f / component;
    ray.pad[i] = ray.box_pad * __builtin_fabsf(ray.inverse[i]);
    ray.near_at[i] = 8 * i + (component < 0.0f ? kBoundBytes : 0u);
  }
  const float x = __builtin_fabsf(d[0]), y = __builtin_fabsf(d[1]), z = __builtin_fabsf(d[2]);
  ray.kz = z >= x && z >= y ? 2u : y >= x ? 1u : 0u;
  ray.kx = ray.kz == 2 ? 0 : ray.kz + 1;
  ray.ky = ray.kx == 2 ? 0 : ray.kx + 1;
  ray.sz = 1.0f / d[ray.kz];
  ray.sx = d[ray.kx] / d[ray.kz];
  ray.sy = d[ray.ky] / d[ray.kz];
}

/// Scales a direction by a power of two so that its largest component is in [1, 2); t_scale: t of before for one t of
/// now. False where there is no direction, or coordinates are beyond any use.
inline bool normalize(const double origin[3], double direction[3], double& t_scale) {
  double largest = 0.0, away = 0.0;
  for (uint32_t i = 0; i < 3; ++i) {
    const double size = __builtin_fabs(direction[i]), far = __builtin_fabs(origin[i]);
    largest = size > largest ? size : largest;
    away = far > away ? far : away;
  }
  if (!(largest > 0.0 && largest < 1e300 && away < 1e300)) return false;
  t_scale = 1.0 / power_below(largest);
  for (uint32_t i = 0; i < 3; ++i) direction[i] *= t_scale;
  return true;
}

/// Into a tree's grid. False where nothing can be hit.
/// @param tmax of the ray in unit space, inclusive
inline bool enter(const TracePlacement& placement, const TraceTree& tree, const KernelRay& from, float tmax,
                  GridRay& ray) {
  double origin[3], direction[3];
  const double* m = placement.grid_from_unit;
  for (uint32_t i = 0; i < 3; ++i) {
    direction[i] = m[i] * double{from.direction[0]} + m[3 + i] * double{from.direction[1]} +
                   m[6 + i] * double{from.direction[2]};
    origin[i] = m[i] * double{from.origin[0]} + m[3 + i] * double{from.origin[1]} + m[6 + i] * double{from.origin[2]} +
                m[9 + i];
  }
  if (!normalize(origin, direction, ray.t_scale)) return false;
  ray.t_begin = 0.0;
  const double reach = double{tree.max_coordinate};
  const double away = __builtin_fmax(__builtin_fmax(__builtin_fabs(origin[0]), __builtin_fabs(origin[1])),
                                     __builtin_fabs(origin[2]));
  if (away > 4.0 * reach && !approach(placement, 0x1p-8 * reach, origin, direction, ray.t_begin)) return false;
  ray.tnear = static_cast<float>(double{from.tnear} / ray.t_scale - ray.t_begin);
  ray.tmax = static_cast<float>(double{tmax} / ray.t_scale - ray.t_begin);
  aim(ray, origin, direction, tree.max_coordinate);
  return ray.tmax >= 0.0f;
}

} // namespace
} // namespace packtrace::packed
