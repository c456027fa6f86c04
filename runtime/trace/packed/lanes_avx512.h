#pragma once

#include <cstdint>

#include <immintrin.h>

/// Sixteen lanes in one 512-bit register, for rays side by side.
namespace packtrace::packed {
namespace {

struct Avx512Lanes {
  using F = __m512;
  static constexpr uint32_t kLanes = 16;

  static F load(const float* p) { return _mm512_loadu_ps(p); }
  static void store(float* p, F a) { _mm512_storeu_ps(p, a); }
  static F set(float x) { return _mm512_set1_ps(x); }
  /// Eight numbers in both halves, and one of two numbers in each.
  static F twice(const float* p) { return _mm512_broadcast_f32x8(_mm256_loadu_ps(p)); }
  static F two(const float* p, uint32_t a, uint32_t b) {
    return _mm512_mask_broadcastss_ps(_mm512_set1_ps(p[a]), 0xff00, _mm_load_ss(p + b));
  }
  static F add(F a, F b) { return _mm512_add_ps(a, b); }
  static F sub(F a, F b) { return _mm512_sub_ps(a, b); }
  static F mul(F a, F b) { return _mm512_mul_ps(a, b); }
  static F div(F a, F b) { return _mm512_div_ps(a, b); }
  /// a b + c and c - a b, rounded once
  static F fma(F a, F b, F c) { return _mm512_fmadd_ps(a, b, c); }
  static F fnma(F a, F b, F c) { return _mm512_fnmadd_ps(a, b, c); }
  /// a b - c, rounded once
  static F fms(F a, F b, F c) { return _mm512_fmsub_ps(a, b, c); }
  static F min(F a, F b) { return _mm512_min_ps(a, b); }
  static F max(F a, F b) { return _mm512_max_ps(a, b); }
  static F abs(F a) { return _mm512_abs_ps(a); }
  /// The larger magnitude.
  static F largest(F a, F b) { return max(abs(a), abs(b)); }
  static F negate(F a) {
    return _mm512_castsi512_ps(
        _mm512_xor_si512(_mm512_castps_si512(a), _mm512_set1_epi32(static_cast<int32_t>(0x80000000u))));
  }
  /// The lanes of 16 numbers that are x, as bits.
  static uint32_t equal(const uint32_t* p, uint32_t x) {
    return _mm512_cmpeq_epi32_mask(_mm512_loadu_si512(p), _mm512_set1_epi32(static_cast<int32_t>(x)));
  }
  static uint32_t less(F a, F b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
  static uint32_t less_equal(F a, F b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
};

} // namespace
} // namespace packtrace::packed
