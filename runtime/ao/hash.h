#pragma once

#include <cstdint>

namespace packtrace {

/// Bijective hash. Source: Wellons, "Prospecting for hash functions" (2018), lowbias32.
constexpr uint32_t hash32(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

constexpr uint32_t hash_combine(uint32_t seed, uint32_t value) { return hash32(seed + 0x9e3779b9u + hash32(value)); }

/// Maps 32 random bits to [0, 1). int32_t: AVX2 converts no unsigned numbers.
inline float unit_float(uint32_t bits) { return static_cast<float>(static_cast<int32_t>(bits >> 8)) * 0x1p-24f; }

} // namespace packtrace
