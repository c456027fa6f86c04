#pragma once

#include <cstdint>

namespace packtrace::scenegen {

/// A bijective 64-bit hash. Source: D. Stafford, "Better Bit Mixing", 2011, variant 13.
constexpr uint64_t hash_bits(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Random numbers from a hashed counter. They are equal on every machine; the standard library's distributions do not
/// guarantee that.
class Random {
public:
  /// Streams of one seed are independent, so additional draws in one part of a scene do not change the other parts.
  explicit constexpr Random(uint64_t seed, uint64_t stream = 0) : state_(hash_bits(seed ^ hash_bits(stream + kStep))) {}

  /// Next 64 random bits.
  constexpr uint64_t bits() { return hash_bits(state_ += kStep); }
  /// Uniform in [0, 1), a multiple of 2^-53.
  constexpr double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// Uniform in [lo, hi).
  constexpr double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  /// Uniform in [0, n); n > 0.
  constexpr uint32_t below(uint32_t n) { return static_cast<uint32_t>(((bits() >> 32) * n) >> 32); }
  /// Returns true with the given probability.
  constexpr bool chance(double probability) { return uniform() < probability; }

private:
  static constexpr uint64_t kStep = 0x9e3779b97f4a7c15u; // 2^64 / golden ratio
  uint64_t state_;
};

} // namespace packtrace::scenegen
