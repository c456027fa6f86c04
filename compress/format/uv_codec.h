#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A point of the texture-coordinate lattice. |coordinate| <= 2^24, so every one is exact as a float.
using UvLattice = std::array<int32_t, 2>;
inline constexpr int32_t kMaxUvLattice = 1 << 24;
inline constexpr int32_t kMinUvExponent = -148;
inline constexpr int32_t kMaxUvExponent = 104; // the ulp of the largest floats

/// Codes per texel of the finest mask that a geometry's coordinates look up.
inline constexpr double kUvCodesPerTexel = 16.0;

/// Exponent e of the step 2^e for one axis: at most 1 / (16 texels |scale|), but not so fine that max_abs would leave
/// the lattice; there the step is about the float's own.
/// @param texels the mask's size along the axis, >= 1
/// @param scale  texture coordinates per uv (AlphaMask::uv_scale)
/// @param max_abs largest |uv| of the geometry along the axis
int32_t choose_uv_exponent(uint32_t texels, float scale, float max_abs);

inline int32_t to_uv_lattice(float uv, int32_t exponent) {
  return static_cast<int32_t>(std::lrint(std::ldexp(static_cast<double>(uv), -exponent)));
}

/// Exact: a 25-bit integer times a power of two.
inline float from_uv_lattice(int32_t lattice, float step) { return static_cast<float>(lattice) * step; }

} // namespace packtrace
