#pragma once

#include <cstdint>

#include <immintrin.h>

/// Eight lanes in one 256-bit register.
namespace packtrace::packed {
namespace {

/// The low and high halves of the 64 single-bit masks.
struct HalvesOfBits {
  uint32_t half[64][2];
  constexpr HalvesOfBits() : half{} {
    for (uint32_t i = 0; i < 64; ++i) half[i][i / 32] = uint32_t{1} << (i % 32);
  }
};
alignas(64) constexpr HalvesOfBits kHalvesOfBits;

struct Avx2Lanes {
  using F = __m256;
  static constexpr uint32_t kLanes = 8;

  /// One 64-bit mask per lane.
  struct Masks {
    __m256i low = _mm256_setzero_si256(), high = _mm256_setzero_si256(); ///< bits 0 to 31 and 32 to 63 of each mask

    /// Sets bit `bit` in the masks of the lanes where a <= b.
    void add_less_equal(F a, F b, uint32_t bit) {
      const __m256i all = _mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_LE_OQ));
      const auto lanes = [&](uint32_t half) {
        return _mm256_and_si256(all, _mm256_set1_epi32(static_cast<int32_t>(kHalvesOfBits.half[bit][half])));
      };
      low = _mm256_or_si256(low, lanes(0));
      high = _mm256_or_si256(high, lanes(1));
    }
    /// Returns the lanes whose masks are not 0, as a bit mask.
    uint32_t read(uint64_t (&out)[8]) const {
      const __m256i even = _mm256_unpacklo_epi32(low, high), odd = _mm256_unpackhi_epi32(low, high); // 0 1 4 5, 2 3 6 7
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(out), _mm256_permute2x128_si256(even, odd, 0x20));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + 4), _mm256_permute2x128_si256(even, odd, 0x31));
      const __m256i none = _mm256_cmpeq_epi32(_mm256_or_si256(low, high), _mm256_setzero_si256());
      return bits(_mm256_castsi256_ps(none)) ^ 0xffu;
    }
  };

  static F load(const float* p) { return _mm256_loadu_ps(p); }
  static void store(float* p, F a) { _mm256_storeu_ps(p, a); }
  static F load_bytes(const uint8_t* p) {
    return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p))));
  }
  static F set(float x) { return _mm256_set1_ps(x); }
  static F add(F a, F b) { return _mm256_add_ps(a, b); }
  static F sub(F a, F b) { return _mm256_sub_ps(a, b); }
  static F mul(F a, F b) { return _mm256_mul_ps(a, b); }
  static F div(F a, F b) { return _mm256_div_ps(a, b); }
  /// fma: a b + c, fnma: c - a b; rounded once.
  static F fma(F a, F b, F c) { return _mm256_fmadd_ps(a, b, c); }
  static F fnma(F a, F b, F c) { return _mm256_fnmadd_ps(a, b, c); }
  /// a b - c, rounded once.
  static F fms(F a, F b, F c) { return _mm256_fmsub_ps(a, b, c); }
  static F min(F a, F b) { return _mm256_min_ps(a, b); }
  static F max(F a, F b) { return _mm256_max_ps(a, b); }
  static F abs(F a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
  /// max(|a|, |b|).
  static F largest(F a, F b) { return max(abs(a), abs(b)); }
  static F negate(F a) { return _mm256_xor_ps(_mm256_set1_ps(-0.0f), a); }
  /// Returns the lanes in which eight integers equal x, as a bit mask.
  static uint32_t equal(const uint32_t* p, uint32_t x) {
    const __m256i all = _mm256_cmpeq_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)),
                                           _mm256_set1_epi32(static_cast<int32_t>(x)));
    return bits(_mm256_castsi256_ps(all));
  }
  /// Writes the lanes of a bit mask; other elements of p[0] to p[7] stay.
  static void store(float* p, uint32_t lanes, F a) {
    const __m256i bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i chosen = _mm256_and_si256(_mm256_set1_epi32(static_cast<int32_t>(lanes)), bits);
    _mm256_maskstore_ps(p, _mm256_cmpeq_epi32(chosen, bits), a);
  }
  static void store(uint32_t* p, uint32_t lanes, uint32_t x) {
    store(reinterpret_cast<float*>(p), lanes, _mm256_castsi256_ps(_mm256_set1_epi32(static_cast<int32_t>(x))));
  }
  static uint32_t less(F a, F b) { return bits(_mm256_cmp_ps(a, b, _CMP_LT_OQ)); }
  static uint32_t less_equal(F a, F b) { return bits(_mm256_cmp_ps(a, b, _CMP_LE_OQ)); }

private:
  static uint32_t bits(F mask) { return static_cast<uint32_t>(_mm256_movemask_ps(mask)); }
};

} // namespace
} // namespace packtrace::packed
