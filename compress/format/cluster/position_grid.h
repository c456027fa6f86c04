#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// 2^exponent, for exponents -1022..1023.
inline double exp2_exact(int32_t exponent) {
  return std::bit_cast<double>(static_cast<uint64_t>(exponent + 1023) << 52);
}

/// A point of the position lattice: integer steps from 0 along x, y, z.
using LatticePoint = std::array<int64_t, 3>;

/// A lattice through 0 with the same step along all axes: step = mantissa 2^exponent. Positions that are equal before
/// quantisation are equal bit for bit afterwards, in any cluster or geometry on the same grid.
struct PositionGrid {
  uint32_t mantissa = 8; ///< 8..15
  int32_t exponent = -3; ///< kMinStepExponent..kMaxStepExponent

  double step() const { return static_cast<double>(mantissa) * exp2_exact(exponent); }
  bool operator==(const PositionGrid&) const = default;
};

inline constexpr uint32_t kMinStepMantissa = 8;
inline constexpr uint32_t kMaxStepMantissa = 15;
/// The range reaches far below the smallest and far above the largest float, and m 2^e is always a normal double.
inline constexpr int32_t kMinStepExponent = -1000;
inline constexpr int32_t kMaxStepExponent = 900;

/// Lattice coordinates lie within +-2^55: extents fit one bit field, and sums of two coordinates do not overflow.
inline constexpr uint32_t kMaxLatticeBits = 55;
inline constexpr int64_t kMaxLattice = int64_t{1} << kMaxLatticeBits;

/// Returns the coarsest grid whose step is at most max_step; its step is more than 8/9 of max_step.
/// Throws Error(kLimitExceeded) unless max_step is positive and within the exponent range.
PositionGrid choose_position_grid(double max_step);

/// Whether all coordinates up to max_abs can be quantised to lattice coordinates.
inline bool fits_lattice(double max_abs, double step) {
  return max_abs / step < static_cast<double>(kMaxLattice) - 1.0;
}

/// Nearest lattice coordinate, ties to even. fits_lattice() must hold.
inline int64_t to_lattice(double p, double step) { return std::llrint(p / step); }

/// Decoded position of a lattice coordinate. Monotone in `lattice`, because each rounding is.
inline float from_lattice(int64_t lattice, double step) {
  return static_cast<float>(static_cast<double>(lattice) * step);
}

/// Upper bound of |decoded - p| per axis for |p| <= max_abs: half a step, half an ulp of the float result, and the
/// rounding of the quotient and the product in double.
double position_error_bound(double step, double max_abs);

} // namespace packtrace
