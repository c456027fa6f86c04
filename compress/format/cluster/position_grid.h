#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// 2^exponent for -1022..1023.
inline double exp2_exact(int32_t exponent) {
  return std::bit_cast<double>(static_cast<uint64_t>(exponent + 1023) << 52);
}

/// A point of the position lattice: whole steps from 0 along x, y, z.
using LatticePoint = std::array<int64_t, 3>;

/// A lattice anchored at 0 with the same step along all axes: step = mantissa 2^exponent. Everything quantised on one
/// grid agrees bit for bit wherever it agreed before, whatever cluster or geometry it belongs to.
struct PositionGrid {
  uint32_t mantissa = 8; ///< 8..15
  int32_t exponent = -3; ///< kMinStepExponent..kMaxStepExponent

  double step() const { return static_cast<double>(mantissa) * exp2_exact(exponent); }
  bool operator==(const PositionGrid&) const = default;
};

inline constexpr uint32_t kMinStepMantissa = 8;
inline constexpr uint32_t kMaxStepMantissa = 15;
/// Far finer than the smallest float, far coarser than the largest, and m 2^e is a normal double throughout.
inline constexpr int32_t kMinStepExponent = -1000;
inline constexpr int32_t kMaxStepExponent = 900;

/// Lattice coordinates stay within +-2^55: extents fit one bit-stream field, and sums of two cannot overflow.
inline constexpr uint32_t kMaxLatticeBits = 55;
inline constexpr int64_t kMaxLattice = int64_t{1} << kMaxLatticeBits;

/// The coarsest grid whose step is at most max_step; its step is more than 8/9 of it.
/// Throws Error(kLimitExceeded) unless max_step is positive and within the exponent range.
PositionGrid choose_position_grid(double max_step);

/// Whether all coordinates up to max_abs have a lattice coordinate.
inline bool fits_lattice(double max_abs, double step) {
  return max_abs / step < static_cast<double>(kMaxLattice) - 1.0;
}

/// Nearest lattice coordinate, ties to even. The caller has checked fits_lattice().
inline int64_t to_lattice(double p, double step) { return std::llrint(p / step); }

/// The position a lattice coordinate stands for. Monotone in `lattice`: all roundings are.
inline float from_lattice(int64_t lattice, double step) {
  return static_cast<float>(static_cast<double>(lattice) * step);
}

/// Bound of |decoded - p| per axis for |p| <= max_abs: half a step, half an ulp of the float result, and the double
/// roundings of the quotient and of the product.
double position_error_bound(double step, double max_abs);

} // namespace packtrace
