#pragma once

#include <cstdint>

#include <immintrin.h>

/// Sixteen lanes in one 512-bit register, for tests with several rays in a register.
namespace packtrace::packed {
namespace {

struct Avx512Lanes {
  using F = __m512;
  static constexpr uint32_t kLanes = 16;

  static F load(const float* p) { return _mm512_loadu_ps(p); }
  static void store(float* p, F a) { _mm512_storeu_ps(p, a); }
  static F set(float x) { return _mm512_set1_ps(x); }
  /// Loads kCount (4 or 8) floats and repeats them to fill the register.
  template <uint32_t kCount>
  static F repeat(const float* p) {
    if constexpr (kCount == 8) return _mm512_broadcast_f32x8(_mm256_loadu_ps(p));
    return _mm512_broadcast_f32x4(_mm_loadu_ps(p));
  }
  /// Reads floats kFirst to kFirst + 3 of each record. out[n] holds float kFirst + n of each record, kCount times in a
  /// row.
  template <uint32_t kCount, uint32_t kFirst, typename Record>
  static void spread(const Record* const (&records)[kLanes / kCount], F (&out)[4]) {
    const auto four = [&](uint32_t i) { return reinterpret_cast<const __m128*>(records[i]) + kFirst / 4; };
    F all;
    if constexpr (kCount == 8) {
      all = _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_broadcast_ps(four(0))), _mm256_broadcast_ps(four(1)), 1);
    } else {
      const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(*four(0)), *four(1), 1);
      const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(*four(2)), *four(3), 1);
      all = _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
    }
    out[0] = _mm512_permute_ps(all, 0x00), out[1] = _mm512_permute_ps(all, 0x55);
    out[2] = _mm512_permute_ps(all, 0xaa), out[3] = _mm512_permute_ps(all, 0xff);
  }
  static F add(F a, F b) { return _mm512_add_ps(a, b); }
  static F sub(F a, F b) { return _mm512_sub_ps(a, b); }
  static F mul(F a, F b) { return _mm512_mul_ps(a, b); }
  static F div(F a, F b) { return _mm512_div_ps(a, b); }
  /// fma: a b + c, fnma: c - a b; rounded once.
  static F fma(F a, F b, F c) { return _mm512_fmadd_ps(a, b, c); }
  static F fnma(F a, F b, F c) { return _mm512_fnmadd_ps(a, b, c); }
  /// a b - c, rounded once.
  static F fms(F a, F b, F c) { return _mm512_fmsub_ps(a, b, c); }
  static F min(F a, F b) { return _mm512_min_ps(a, b); }
  static F max(F a, F b) { return _mm512_max_ps(a, b); }
  static F abs(F a) { return _mm512_abs_ps(a); }
  /// max(|a|, |b|).
  static F largest(F a, F b) { return max(abs(a), abs(b)); }
  static F negate(F a) {
    return _mm512_castsi512_ps(
        _mm512_xor_si512(_mm512_castps_si512(a), _mm512_set1_epi32(static_cast<int32_t>(0x80000000u))));
  }
  /// Returns the lanes in which 16 integers equal x, as a bit mask.
  static uint32_t equal(const uint32_t* p, uint32_t x) {
    return _mm512_cmpeq_epi32_mask(_mm512_loadu_si512(p), _mm512_set1_epi32(static_cast<int32_t>(x)));
  }
  /// Writes the lanes of a bit mask; other elements of p[0] to p[15] stay.
  static void store(float* p, uint32_t lanes, F a) { _mm512_mask_storeu_ps(p, static_cast<__mmask16>(lanes), a); }
  static void store(uint32_t* p, uint32_t lanes, uint32_t x) {
    _mm512_mask_storeu_epi32(p, static_cast<__mmask16>(lanes), _mm512_set1_epi32(static_cast<int32_t>(x)));
  }
  static uint32_t less(F a, F b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
  static uint32_t less_equal(F a, F b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
};

} // namespace
} // namespace packtrace::packed
