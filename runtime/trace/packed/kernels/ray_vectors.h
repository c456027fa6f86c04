#pragma once

#include <cstdint>

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

/// Vectors with one lane per ray of a block, for the setup of rays before they are traced.
namespace packtrace::packed {
namespace {

// These are the compiler's vector extensions, so one source yields the same results on all instruction sets. GCC splits
// vectors larger than its registers into scalars, so vectors of doubles hold half a block.
#if defined(__AVX512F__)
constexpr uint32_t kBlock = 16; ///< number of rays that are set up at once
constexpr uint32_t kDoubleLanes = 8;
#else
constexpr uint32_t kBlock = 8;
constexpr uint32_t kDoubleLanes = 4;
#endif
constexpr uint32_t kBlockLanes = (1u << kBlock) - 1; ///< bit mask of all lanes
using Floats = float __attribute__((vector_size(4 * kBlock)));
using Ints = int32_t __attribute__((vector_size(4 * kBlock)));
// One lane per ray of half a block.
using Doubles = double __attribute__((vector_size(8 * kDoubleLanes)));
using Longs = int64_t __attribute__((vector_size(8 * kDoubleLanes)));
using HalfFloats = float __attribute__((vector_size(4 * kDoubleLanes)));
static_assert(kBlock == 2 * kDoubleLanes);

/// A vector of any alignment. Where GCC 12 copies vectors of 32 bytes by memcpy(), it moves 16 bytes at a time, and a
/// register that is read from the copy waits until both halves are in the cache. With AVX-512 this gains nothing.
template <typename Vector>
struct [[gnu::packed, gnu::may_alias]] Unaligned {
  Vector vector;
};
template <typename Vector, typename Element>
inline void read_block(Vector& v, const Element* p) {
#if defined(__AVX512F__)
  __builtin_memcpy(&v, p, sizeof v);
#else
  v = reinterpret_cast<const Unaligned<Vector>*>(p)->vector;
#endif
}
template <typename Vector, typename Element>
inline void write_block(Element* p, const Vector& v) {
#if defined(__AVX512F__)
  __builtin_memcpy(p, &v, sizeof v);
#else
  reinterpret_cast<Unaligned<Vector>*>(p)->vector = v;
#endif
}

template <typename Vector>
inline void keep_larger(Vector& a, const Vector& b) {
  a = a > b ? a : b;
}

/// Does the same in the lanes of a bit mask.
[[gnu::always_inline]] inline void keep_larger(Floats& a, uint32_t lanes, const Floats& b) {
#if defined(__AVX512F__)
  a = _mm512_mask_max_ps(a, static_cast<__mmask16>(lanes), b, a);
#else
  alignas(32) constexpr int32_t kLaneBits[kBlock] = {1, 2, 4, 8, 16, 32, 64, 128};
  Ints bits;
  read_block(bits, kLaneBits);
  a = (((bits & static_cast<int32_t>(lanes)) != 0) & (b > a)) ? b : a;
#endif
}

// For eight elements GCC 12 would emit two conversions of four.
inline Doubles to_doubles(const HalfFloats& x) {
#if defined(__AVX512F__)
  return _mm512_cvtps_pd(x);
#else
  return __builtin_convertvector(x, Doubles);
#endif
}
inline HalfFloats to_floats(const Doubles& x) {
#if defined(__AVX512F__)
  return _mm512_cvtpd_ps(x);
#else
  return __builtin_convertvector(x, HalfFloats);
#endif
}
inline Doubles read_doubles(const float* p) {
  HalfFloats half;
  read_block(half, p);
  return to_doubles(half);
}
inline Floats join(const HalfFloats& low, const HalfFloats& high) {
#if defined(__AVX512F__)
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
#else
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
#endif
}

inline float largest_lane(const Floats& x) {
#if defined(__AVX512F__)
  return _mm512_reduce_max_ps(x);
#else
  float lanes[kBlock];
  write_block(lanes, x);
  float most = lanes[0];
  for (uint32_t i = 1; i < kBlock; ++i) most = lanes[i] > most ? lanes[i] : most;
  return most;
#endif
}

/// Reads eight floats per ray of a block. Row i holds those of ray i and, in blocks of 16, of ray i + 8.
inline void read_rows(const float* const (&rays)[kBlock], Floats (&rows)[8]) {
  for (uint32_t i = 0; i < 8; ++i) {
#if defined(__AVX512F__)
    HalfFloats low, high;
    read_block(low, rays[i]);
    read_block(high, rays[i + 8]);
    rows[i] = join(low, high);
#else
    read_block(rows[i], rays[i]);
#endif
  }
}

/// For each pair of rows kDistance apart, swaps the off-diagonal blocks of kDistance columns.
template <int kDistance, int... kLow>
inline void swap_parts(Floats (&rows)[8]) {
  for (uint32_t i = 0; i < 8; ++i)
    if ((i & kDistance) == 0) {
      const Floats a = rows[i], b = rows[i + kDistance];
#if defined(__AVX512F__)
      constexpr auto lane = [](int k) { return k < 8 ? k : k + 8; }; // index into a, or into b, which follows it
      rows[i] = __builtin_shufflevector(a, b, lane(kLow)..., lane(kLow) + 8 ...);
      rows[i + kDistance] = __builtin_shufflevector(a, b, lane(kLow) + kDistance..., lane(kLow) + kDistance + 8 ...);
#else
      rows[i] = __builtin_shufflevector(a, b, kLow...);
      rows[i + kDistance] = __builtin_shufflevector(a, b, (kLow + kDistance)...);
#endif
    }
}

/// Transposes the rows of read_rows() into one vector per value, with one lane per ray.
[[gnu::always_inline]] inline void transpose(Floats (&rows)[8]) {
  swap_parts<4, 0, 1, 2, 3, 8, 9, 10, 11>(rows); // swap 4 x 4 blocks, then 2 x 2, then single elements
  swap_parts<2, 0, 1, 8, 9, 4, 5, 12, 13>(rows);
  swap_parts<1, 0, 8, 2, 10, 4, 12, 6, 14>(rows);
}

/// The inverse of read_rows(); writes sizeof(Record) bytes per ray.
template <typename Record>
inline void write_rows(const Floats (&rows)[8], Record* records) {
  for (uint32_t i = 0; i < 8; ++i) {
#if defined(__AVX512F__)
    const HalfFloats high = __builtin_shufflevector(rows[i], rows[i], 8, 9, 10, 11, 12, 13, 14, 15);
    __builtin_memcpy(&records[i + 8], &high, sizeof(Record));
#endif
    __builtin_memcpy(&records[i], &rows[i], sizeof(Record));
  }
}

/// Returns the largest lane of each of eight vectors.
inline void largest_lanes(const Floats (&vectors)[8], float (&out)[8]) {
  Floats rows[8];
  for (uint32_t i = 0; i < 8; ++i) rows[i] = vectors[i];
  transpose(rows);
  for (uint32_t step = 4; step > 0; step /= 2)
    for (uint32_t i = 0; i < step; ++i) keep_larger(rows[i], rows[i + step]);
  float lanes[kBlock]; // one lane per vector, or one per vector in each half
  write_block(lanes, rows[0]);
  for (uint32_t i = 0; i < 8; ++i) out[i] = lanes[i] > lanes[kBlock - 8 + i] ? lanes[i] : lanes[kBlock - 8 + i];
}

/// Writes one pair (a, b) per lane.
inline void write_pairs(float (*out)[2], const Floats& a, const Floats& b) {
#if defined(__AVX512F__)
  write_block(&out[0][0], __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
  write_block(&out[8][0], __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31));
#else
  write_block(&out[0][0], __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11));
  write_block(&out[4][0], __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15));
#endif
}

inline Floats magnitude(const Floats& x) { return reinterpret_cast<Floats>(reinterpret_cast<Ints>(x) & 0x7fffffff); }

/// Returns the lanes whose condition is true (all ones), as a bit mask.
inline uint32_t lane_bits(const Ints& condition) {
#if defined(__AVX512F__)
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(condition));
#elif defined(__AVX2__)
  return static_cast<uint32_t>(__builtin_ia32_movmskps256(reinterpret_cast<Floats>(condition)));
#else
  int32_t lanes[kBlock]; // Subscripting a vector goes wrong in GCC 12 under sanitizers.
  write_block(lanes, condition);
  uint32_t bits = 0;
  for (uint32_t i = 0; i < kBlock; ++i) bits |= (lanes[i] != 0 ? 1u : 0u) << i;
  return bits;
#endif
}

/// Returns the lanes in which low < x < high, as a bit mask.
inline uint32_t lanes_between(double low, const Doubles& x, double high) {
  const Longs inside = (x > low) & (x < high);
#if defined(__AVX512F__)
  return _mm512_movepi64_mask(reinterpret_cast<__m512i>(inside));
#elif defined(__AVX2__)
  return static_cast<uint32_t>(__builtin_ia32_movmskpd256(reinterpret_cast<Doubles>(inside)));
#else
  int64_t lanes[kDoubleLanes]; // as above
  write_block(lanes, inside);
  uint32_t bits = 0;
  for (uint32_t i = 0; i < kDoubleLanes; ++i) bits |= (lanes[i] != 0 ? 1u : 0u) << i;
  return bits;
#endif
}

} // namespace
} // namespace packtrace::packed
