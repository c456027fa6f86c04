#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

/// Vectors as wide as those of the instruction set for which the including file is compiled. Plain loops are slower:
/// GCC 12 widens 16-bit products to 32 bits, and in loops over types of several widths it processes one vector of the
/// narrowest type at a time, which spills most variables to memory. The functions have internal linkage, because each
/// instruction set compiles its own.
namespace packtrace {
namespace {

#if defined(__AVX512BW__)
constexpr int kLanes = 32;
#elif defined(__AVX2__)
constexpr int kLanes = 16;
#else
constexpr int kLanes = 8;
#endif

using U16 __attribute__((vector_size(2 * kLanes))) = uint16_t;
using I16 __attribute__((vector_size(2 * kLanes))) = int16_t;

constexpr int kFloats = kLanes / 2;
using F32 __attribute__((vector_size(4 * kFloats))) = float;
using I32 __attribute__((vector_size(4 * kFloats))) = int32_t;

inline U16 all(uint16_t value) { return U16{} + value; }
inline F32 all(float value) { return F32{} + value; }

/// The vector type whose lanes have a given element type.
template <typename T>
struct LanesOf;
template <>
struct LanesOf<uint16_t> {
  using Type = U16;
};
template <>
struct LanesOf<int16_t> {
  using Type = I16;
};
template <>
struct LanesOf<float> {
  using Type = F32;
};
template <>
struct LanesOf<uint32_t> {
  using Type = I32;
};
template <>
struct LanesOf<int32_t> {
  using Type = I32;
};

template <typename T>
inline auto load(const T* from) {
  typename LanesOf<T>::Type v;
  std::memcpy(&v, from, sizeof(v));
  return v;
}
template <typename T>
inline void store(T* to, typename LanesOf<T>::Type v) {
  std::memcpy(to, &v, sizeof(v));
}
/// Loads and stores the first `count` lanes only, or all if there are fewer; other lanes are 0.
template <typename T>
inline auto load_first(int count, const T* from) {
  typename LanesOf<T>::Type v{};
  if (count >= static_cast<int>(sizeof(v) / sizeof(T))) return load(from);
  if (count > 0) std::memcpy(&v, from, static_cast<size_t>(count) * sizeof(T));
  return v;
}
template <typename T>
inline void store_first(int count, T* to, typename LanesOf<T>::Type v) {
  if (count >= static_cast<int>(sizeof(v) / sizeof(T)))
    store(to, v);
  else
    std::memcpy(to, &v, static_cast<size_t>(count) * sizeof(T));
}

/// Lanes kFirst, kFirst + 2, ... of two vectors that follow each other.
template <int kFirst, int... kLane>
inline F32 every_second(F32 a, F32 b, std::integer_sequence<int, kLane...>) {
  return __builtin_shufflevector(a, b, kFirst + 2 * kLane...);
}
using EachLane = std::make_integer_sequence<int, kFloats>;
inline F32 even_lanes(F32 a, F32 b) { return every_second<0>(a, b, EachLane()); }
inline F32 odd_lanes(F32 a, F32 b) { return every_second<1>(a, b, EachLane()); }

template <int... kLane>
constexpr I32 numbers(std::integer_sequence<int, kLane...>) {
  return I32{kLane...};
}
constexpr I32 kEachLane = numbers(EachLane()); ///< 0, 1, 2 ...

inline I32 both(I32 a, I32 b) { return a & b; }
inline F32 select(I32 condition, F32 a, F32 b) { return condition ? a : b; }
inline F32 as_floats(I32 v) { return __builtin_convertvector(v, F32); }
inline I32 truncated(F32 v) { return __builtin_convertvector(v, I32); }
inline I32 rounded_down(F32 v) {
  const I32 towards_zero = truncated(v);
  return towards_zero + (as_floats(towards_zero) > v); // true is -1
}

// lesser, greater; average: of two lanes, rounded up; product: the upper half, which is the product of fractions in
// units of 2^-16; part_of: the product of a fraction in units of 2^-15 and a value, rounded to nearest. load_wide:
// of kFloats values; store_bytes, store_words: of values that fit; any: whether a comparison is true in any lane;
// any_greater: likewise; root: square root; sum_of_products: of both 16-bit halves.
#if defined(__AVX512BW__)
inline U16 lesser(U16 a, U16 b) { return (U16)_mm512_min_epu16((__m512i)a, (__m512i)b); }
inline U16 greater(U16 a, U16 b) { return (U16)_mm512_max_epu16((__m512i)a, (__m512i)b); }
inline U16 average(U16 a, U16 b) { return (U16)_mm512_avg_epu16((__m512i)a, (__m512i)b); }
inline U16 product(U16 a, U16 b) { return (U16)_mm512_mulhi_epu16((__m512i)a, (__m512i)b); }
inline I16 part_of(U16 a, I16 b) { return (I16)_mm512_mulhrs_epi16((__m512i)a, (__m512i)b); }
inline U16 magnitude(I16 a) { return (U16)_mm512_abs_epi16((__m512i)a); }
inline U16 load_bytes(const uint8_t* from) {
  return (U16)_mm512_cvtepu8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
}
constexpr __mmask16 kEach = 0xffff; // GCC 12 wrongly warns of uninitialised values in the unmasked forms
inline F32 lesser(F32 a, F32 b) { return (F32)_mm512_maskz_min_ps(kEach, (__m512)b, (__m512)a); }
inline F32 greater(F32 a, F32 b) { return (F32)_mm512_maskz_max_ps(kEach, (__m512)b, (__m512)a); }
inline F32 magnitude(F32 a) { return (F32)((I32)a & 0x7fffffff); }
inline I32 load_wide(const int16_t* from) {
  return (I32)_mm512_maskz_cvtepi16_epi32(kEach, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
}
inline I32 load_wide(const uint16_t* from) {
  return (I32)_mm512_maskz_cvtepu16_epi32(kEach, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
}
inline I32 sum_of_products(I32 a, I32 b) { return (I32)_mm512_madd_epi16((__m512i)a, (__m512i)b); }
inline bool any(I32 condition) { return _mm512_test_epi32_mask((__m512i)condition, (__m512i)condition) != 0; }
inline bool any_greater(F32 a, F32 b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GT_OQ) != 0; }
inline F32 root(F32 a) { return (F32)_mm512_maskz_sqrt_ps(kEach, (__m512)a); }
template <typename T>
inline void store_words(T* to, I32 v) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm512_maskz_cvtepi32_epi16(kEach, (__m512i)v));
}
inline void store_bytes(uint8_t* to, I32 v) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm512_maskz_cvtepi32_epi8(kEach, (__m512i)v));
}
#elif defined(__AVX2__)
inline U16 lesser(U16 a, U16 b) { return (U16)_mm256_min_epu16((__m256i)a, (__m256i)b); }
inline U16 greater(U16 a, U16 b) { return (U16)_mm256_max_epu16((__m256i)a, (__m256i)b); }
inline U16 average(U16 a, U16 b) { return (U16)_mm256_avg_epu16((__m256i)a, (__m256i)b); }
inline U16 product(U16 a, U16 b) { return (U16)_mm256_mulhi_epu16((__m256i)a, (__m256i)b); }
inline I16 part_of(U16 a, I16 b) { return (I16)_mm256_mulhrs_epi16((__m256i)a, (__m256i)b); }
inline U16 magnitude(I16 a) { return (U16)_mm256_abs_epi16((__m256i)a); }
inline U16 load_bytes(const uint8_t* from) {
  return (U16)_mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
inline F32 lesser(F32 a, F32 b) { return (F32)_mm256_min_ps((__m256)b, (__m256)a); }
inline F32 greater(F32 a, F32 b) { return (F32)_mm256_max_ps((__m256)b, (__m256)a); }
inline F32 magnitude(F32 a) { return (F32)_mm256_andnot_ps(_mm256_set1_ps(-0.0f), (__m256)a); }
inline I32 load_wide(const int16_t* from) {
  return (I32)_mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
inline I32 load_wide(const uint16_t* from) {
  return (I32)_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
inline I32 sum_of_products(I32 a, I32 b) { return (I32)_mm256_madd_epi16((__m256i)a, (__m256i)b); }
inline bool any(I32 condition) { return _mm256_testz_si256((__m256i)condition, (__m256i)condition) == 0; }
inline bool any_greater(F32 a, F32 b) {
  return _mm256_movemask_ps(_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_GT_OQ)) != 0;
}
inline F32 root(F32 a) { return (F32)_mm256_sqrt_ps((__m256)a); }
template <typename T>
inline void store_words(T* to, I32 v) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to),
                   _mm_packus_epi32(_mm256_castsi256_si128((__m256i)v), _mm256_extracti128_si256((__m256i)v, 1)));
}
inline void store_bytes(uint8_t* to, I32 v) {
  const __m128i words = _mm_packs_epi32(_mm256_castsi256_si128((__m256i)v), _mm256_extracti128_si256((__m256i)v, 1));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(to), _mm_packus_epi16(words, words));
}
#else
template <typename F>
U16 by_lane(U16 a, U16 b, const F& f) {
  U16 r{};
  for (int i = 0; i < kLanes; ++i) r[i] = static_cast<uint16_t>(f(uint32_t{a[i]}, uint32_t{b[i]}));
  return r;
}
inline U16 lesser(U16 a, U16 b) { return a < b ? a : b; }
inline U16 greater(U16 a, U16 b) { return a < b ? b : a; }
inline U16 average(U16 a, U16 b) {
  return by_lane(a, b, [](uint32_t x, uint32_t y) { return (x + y + 1) >> 1; });
}
inline U16 product(U16 a, U16 b) {
  return by_lane(a, b, [](uint32_t x, uint32_t y) { return (x * y) >> 16; });
}
inline I16 part_of(U16 a, I16 b) {
  const auto rounded = [](uint32_t x, uint32_t y) {
    return (static_cast<int16_t>(x) * static_cast<int16_t>(y) + 0x4000) >> 15;
  };
  return (I16)by_lane(a, (U16)b, rounded);
}
inline U16 magnitude(I16 a) { return (U16)(a < 0 ? -a : a); }
inline U16 load_bytes(const uint8_t* from) {
  U16 v{};
  for (int i = 0; i < kLanes; ++i) v[i] = from[i];
  return v;
}
inline F32 lesser(F32 a, F32 b) { return b < a ? b : a; }
inline F32 greater(F32 a, F32 b) { return a < b ? b : a; }
inline F32 magnitude(F32 a) { return (F32)((I32)a & 0x7fffffff); }
inline I32 load_wide(const int16_t* from) {
  I32 v{};
  for (int i = 0; i < kFloats; ++i) v[i] = from[i];
  return v;
}
inline I32 load_wide(const uint16_t* from) {
  I32 v{};
  for (int i = 0; i < kFloats; ++i) v[i] = from[i];
  return v;
}
inline I32 sum_of_products(I32 a, I32 b) { return ((a << 16) >> 16) * ((b << 16) >> 16) + (a >> 16) * (b >> 16); }
inline bool any(I32 condition) {
  int32_t found = 0;
  for (int i = 0; i < kFloats; ++i) found |= condition[i];
  return found != 0;
}
inline bool any_greater(F32 a, F32 b) { return any(a > b); }
inline F32 root(F32 a) {
  F32 v{};
  for (int i = 0; i < kFloats; ++i) v[i] = std::sqrt(a[i]);
  return v;
}
template <typename T>
inline void store_words(T* to, I32 v) {
  for (int i = 0; i < kFloats; ++i) to[i] = static_cast<T>(v[i]);
}
inline void store_bytes(uint8_t* to, I32 v) {
  for (int i = 0; i < kFloats; ++i) to[i] = static_cast<uint8_t>(v[i]);
}
#endif

/// Pairs of 16-bit numbers, for sum_of_products.
inline I32 load_pairs(const int16_t* low, const int16_t* high) {
  return load_wide(reinterpret_cast<const uint16_t*>(low)) | (load_wide(high) << 16);
}
/// store_words() of the first `count` lanes only, or of all if there are fewer.
inline void store_first_words(int count, uint16_t* to, I32 v) {
  if (count >= kFloats) return store_words(to, v);
  uint16_t words[kFloats];
  store_words(words, v);
  std::memcpy(to, words, static_cast<size_t>(count) * sizeof(*to));
}

} // namespace
} // namespace packtrace
