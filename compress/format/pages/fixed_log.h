#pragma once

#include <bit>
#include <cstdint>

namespace packtrace {

inline constexpr int32_t kLogOne = 1 << 10; ///< the logarithm of 2

/// Binary logarithm times kLogOne, linear between powers of two, the same on every machine. Of 0: -1023 kLogOne.
/// @param x not negative
inline int32_t log2_fixed(double x) { return static_cast<int32_t>(std::bit_cast<uint64_t>(x) >> 42) - 1023 * kLogOne; }

} // namespace packtrace
