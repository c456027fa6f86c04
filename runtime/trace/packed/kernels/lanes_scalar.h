#pragma once

#include <cstdint>

/// Eight lanes in portable C++: the reference that the other instruction sets must match bit for bit.
namespace packtrace::packed {
namespace {

struct ScalarLanes {
  static constexpr uint32_t kLanes = 8;
  struct F {
    float lane[8];
  };

  /// One 64-bit mask per lane.
  struct Masks {
    uint64_t lane[8] = {};

    /// Sets bit `bit` in the masks of the lanes where a <= b.
    void add_less_equal(F a, F b, uint32_t bit) {
      for (uint32_t i = 0; i < 8; ++i) lane[i] |= uint64_t{a.lane[i] <= b.lane[i]} << bit;
    }
    /// Returns the lanes whose masks are not 0, as a bit mask.
    uint32_t read(uint64_t (&out)[8]) const {
      for (uint32_t i = 0; i < 8; ++i) out[i] = lane[i];
      return bits([&](uint32_t i) { return lane[i] != 0; });
    }
  };

  template <typename Function>
  static F each(Function function) {
    F result;
    for (uint32_t i = 0; i < 8; ++i) result.lane[i] = function(i);
    return result;
  }
  template <typename Function>
  static uint32_t bits(Function function) {
    uint32_t result = 0;
    for (uint32_t i = 0; i < 8; ++i) result |= (function(i) ? 1u : 0u) << i;
    return result;
  }

  static F load(const float* p) {
    return each([&](uint32_t i) { return p[i]; });
  }
  static void store(float* p, F a) {
    for (uint32_t i = 0; i < 8; ++i) p[i] = a.lane[i];
  }
  static F load_bytes(const uint8_t* p) {
    return each([&](uint32_t i) { return static_cast<float>(p[i]); });
  }
  static F set(float x) {
    return each([&](uint32_t) { return x; });
  }
  static F add(F a, F b) {
    return each([&](uint32_t i) { return a.lane[i] + b.lane[i]; });
  }
  static F sub(F a, F b) {
    return each([&](uint32_t i) { return a.lane[i] - b.lane[i]; });
  }
  static F mul(F a, F b) {
    return each([&](uint32_t i) { return a.lane[i] * b.lane[i]; });
  }
  static F div(F a, F b) {
    return each([&](uint32_t i) { return a.lane[i] / b.lane[i]; });
  }
  /// fma: a b + c, fnma: c - a b; rounded once.
  static F fma(F a, F b, F c) {
    return each([&](uint32_t i) { return __builtin_fmaf(a.lane[i], b.lane[i], c.lane[i]); });
  }
  static F fnma(F a, F b, F c) {
    return each([&](uint32_t i) { return __builtin_fmaf(-a.lane[i], b.lane[i], c.lane[i]); });
  }
  /// a b - c, rounded once.
  static F fms(F a, F b, F c) {
    return each([&](uint32_t i) { return __builtin_fmaf(a.lane[i], b.lane[i], -c.lane[i]); });
  }
  static F min(F a, F b) {
    return each([&](uint32_t i) { return a.lane[i] < b.lane[i] ? a.lane[i] : b.lane[i]; });
  }
  static F max(F a, F b) {
    return each([&](uint32_t i) { return a.lane[i] > b.lane[i] ? a.lane[i] : b.lane[i]; });
  }
  static F abs(F a) {
    return each([&](uint32_t i) { return __builtin_fabsf(a.lane[i]); });
  }
  /// max(|a|, |b|).
  static F largest(F a, F b) { return max(abs(a), abs(b)); }
  static F negate(F a) {
    return each([&](uint32_t i) { return -a.lane[i]; });
  }
  /// Returns the lanes in which eight integers equal x, as a bit mask.
  static uint32_t equal(const uint32_t* p, uint32_t x) {
    return bits([&](uint32_t i) { return p[i] == x; });
  }
  /// Writes the lanes of a bit mask; other elements of p[0] to p[7] stay.
  static void store(float* p, uint32_t lanes, F a) {
    for (; lanes != 0; lanes &= lanes - 1) p[__builtin_ctz(lanes)] = a.lane[__builtin_ctz(lanes)];
  }
  static void store(uint32_t* p, uint32_t lanes, uint32_t x) {
    for (; lanes != 0; lanes &= lanes - 1) p[__builtin_ctz(lanes)] = x;
  }
  static uint32_t less(F a, F b) {
    return bits([&](uint32_t i) { return a.lane[i] < b.lane[i]; });
  }
  static uint32_t less_equal(F a, F b) {
    return bits([&](uint32_t i) { return a.lane[i] <= b.lane[i]; });
  }
};

} // namespace
} // namespace packtrace::packed
