#pragma once

#include <bit>
#include <cstdint>

#include "runtime/denoise/simd.h"

/// Functions of one value that loops over rows can call and still be vectorised. They give the same bits for every
/// instruction set.
namespace packtrace::reference {

/// Weights of a Gaussian per axis, at the centre and one tap aside.
inline constexpr float kCentre = 0.44198f, kAside = 0.27901f;

inline float saturate(float x) { return smaller(1.0f, larger(0.0f, x)); } // 0 for NaN

/// The largest power of two that is not greater than x, for normal finite x > 0; 0 for 0.
inline float floor_to_power_of_two(float x) { return std::bit_cast<float>(std::bit_cast<uint32_t>(x) & 0x7f800000u); }

/// e^x for x <= 0, with a relative error below 1e-6; 0 below x = -87.
/// 2^i is made from its bits, and 2^f for |f| <= 1/2 is the Taylor polynomial of degree 6 of e^(f ln 2).
inline float exp_of_negative(float x) {
  const float bounded = larger(-88.0f, x);
  const float t = bounded * 1.44269504f;
  const int32_t i = static_cast<int32_t>(t - 0.5f); // rounds to nearest, since t <= 0
  const float f = (t - static_cast<float>(i)) * 0.693147181f;
  const float p =
      1.0f +
      f * (1.0f + f * (0.5f + f * (1.0f / 6.0f + f * (1.0f / 24.0f + f * (1.0f / 120.0f + f * (1.0f / 720.0f))))));
  const float power = std::bit_cast<float>(static_cast<uint32_t>(i + 127) << 23);
  return bounded > -87.0f ? p * power : 0.0f;
}

} // namespace packtrace::reference
