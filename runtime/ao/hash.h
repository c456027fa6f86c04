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

/// Owen's nested uniform scrambling by hashing: whether bit i flips depends only on the lower bits, which are the
/// preceding digits. Source: Laine, Karras, "Stratified sampling for stochastic transparency" (2011); constants by
/// Vegdahl, "Building a better LK hash" (2021).
inline uint32_t scramble(uint32_t digits, uint32_t seed) {
  digits ^= digits * 0x3d20adeau;
  digits += seed;
  digits *= (seed >> 16) | 1u;
  digits ^= digits * 0x05526c56u;
  digits ^= digits * 0x53a22864u;
  return digits;
}

/// The 32 bits in the opposite order.
inline uint32_t reverse_bits(uint32_t v) {
  v = ((v & 0x55555555u) << 1) | ((v >> 1) & 0x55555555u);
  v = ((v & 0x33333333u) << 2) | ((v >> 2) & 0x33333333u);
  v = ((v & 0x0f0f0f0fu) << 4) | ((v >> 4) & 0x0f0f0f0fu);
  v = ((v & 0x00ff00ffu) << 8) | ((v >> 8) & 0x00ff00ffu);
  return (v << 16) | (v >> 16);
}

} // namespace packtrace
