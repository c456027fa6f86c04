#pragma once

#include <cstdint>

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

/// Vectors with a lane for each ray of a block, for what is done to all rays before they are traced.
namespace packtrace::packed {
namespace {

constexpr uint32_t kBlock = 8; ///< rays that are set up at once

// The compiler's own vectors, a lane for each ray of a block, so that all instruction sets get the same from one
// source.
using Floats = float __attribute__((vector_size(4 * kBlock)));
using Ints = int32_t __attribute__((vector_size(4 * kBlock)));
// Doubles take as many registers as they need: the compiler splits larger vectors into single numbers.
#if defined(__AVX512F__)
constexpr uint32_t kDoubleLanes = 8;
#else
constexpr uint32_t kDoubleLanes = 4;
#endif
using DoublePart = double __attribute__((vector_size(8 * kDoubleLanes)));
using LongPart = int64_t __attribute__((vector_size(8 * kDoubleLanes)));
using FloatPart = float __attribute__((vector_size(4 * kDoubleLanes)));
constexpr uint32_t kDoubleParts = kBlock / kDoubleLanes;

struct Doubles {
  DoublePart part[kDoubleParts];

  double get(uint32_t lane) const { return part[lane / kDoubleLanes][lane % kDoubleLanes]; }
  void set(uint32_t lane, double value) { part[lane / kDoubleLanes][lane % kDoubleLanes] = value; }
};

template <typename Function>
inline Doubles each_part(Function function) {
  Doubles result;
#pragma GCC unroll 2
  for (uint32_t i = 0; i < kDoubleParts; ++i) result.part[i] = function(i);
  return result;
}
inline Doubles operator+(const Doubles& a, const Doubles& b) {
  return each_part([&](uint32_t i) { return a.part[i] + b.part[i]; });
}
inline Doubles operator-(const Doubles& a, const Doubles& b) {
  return each_part([&](uint32_t i) { return a.part[i] - b.part[i]; });
}
inline Doubles operator*(const Doubles& a, const Doubles& b) {
  return each_part([&](uint32_t i) { return a.part[i] * b.part[i]; });
}
inline Doubles operator*(double a, const Doubles& b) {
  return each_part([&](uint32_t i) { return a * b.part[i]; });
}
inline Doubles operator+(const Doubles& a, double b) {
  return each_part([&](uint32_t i) { return a.part[i] + b; });
}

inline Doubles read_doubles(const float* p) {
  return each_part([&](uint32_t i) {
    FloatPart part;
    __builtin_memcpy(&part, p + i * kDoubleLanes, sizeof part);
    return __builtin_convertvector(part, DoublePart);
  });
}
inline Doubles to_doubles(const Floats& x) {
  float lanes[kBlock];
  __builtin_memcpy(lanes, &x, sizeof lanes);
  return read_doubles(lanes);
}
inline Floats to_floats(const Doubles& x) {
#if defined(__AVX512F__)
  return __builtin_convertvector(x.part[0], Floats);
#else
  return __builtin_shufflevector(__builtin_convertvector(x.part[0], FloatPart),
                                 __builtin_convertvector(x.part[1], FloatPart), 0, 1, 2, 3, 4, 5, 6, 7);
#endif
}

template <typename Vector, typename Element>
inline void read_block(Vector& v, const Element* p) {
  __builtin_memcpy(&v, p, sizeof v);
}
template <typename Vector, typename Element>
inline void write_block(Element* p, const Vector& v) {
  __builtin_memcpy(p, &v, sizeof v);
}

template <typename Vector>
inline void keep_larger(Vector& a, const Vector& b) {
  a = a > b ? a : b;
}

/// Of rows that are kDistance apart, swaps the off-diagonal parts.
template <int kDistance, int... kLow>
inline void swap_parts(Floats (&rows)[kBlock]) {
  for (uint32_t i = 0; i < kBlock; ++i)
    if ((i & kDistance) == 0) {
      const Floats a = rows[i], b = rows[i + kDistance];
      rows[i] = __builtin_shufflevector(a, b, kLow...);
      rows[i + kDistance] = __builtin_shufflevector(a, b, (kLow + kDistance)...);
    }
}

/// Turns rows into columns.
inline void transpose(Floats (&rows)[kBlock]) {
  static_assert(kBlock == 8);
  swap_parts<4, 0, 1, 2, 3, 8, 9, 10, 11>(rows); // of quarters, of those, of those
  swap_parts<2, 0, 1, 8, 9, 4, 5, 12, 13>(rows);
  swap_parts<1, 0, 8, 2, 10, 4, 12, 6, 14>(rows);
}

/// The lanes whose condition is all ones, as bits.
inline uint32_t lane_bits(const Ints& condition) {
#if defined(__AVX2__)
  return static_cast<uint32_t>(__builtin_ia32_movmskps256(reinterpret_cast<Floats>(condition)));
#else
  int32_t lanes[kBlock]; // a vector's own subscripts go wrong in GCC 12 under sanitizers
  write_block(lanes, condition);
  uint32_t bits = 0;
  for (uint32_t i = 0; i < kBlock; ++i) bits |= (lanes[i] != 0 ? 1u : 0u) << i;
  return bits;
#endif
}

/// The lanes in which low < x < high, as bits.
inline uint32_t lanes_between(double low, const Doubles& x, double high) {
  uint32_t bits = 0;
  for (uint32_t i = 0; i < kDoubleParts; ++i) {
    const LongPart inside = (x.part[i] > low) & (x.part[i] < high);
#if defined(__AVX512F__)
    bits = _mm512_movepi64_mask(reinterpret_cast<__m512i>(inside));
#elif defined(__AVX2__)
    bits |= static_cast<uint32_t>(__builtin_ia32_movmskpd256(reinterpret_cast<DoublePart>(inside)))
            << (kDoubleLanes * i);
#else
    int64_t lanes[kDoubleLanes]; // as above
    write_block(lanes, inside);
    for (uint32_t lane = 0; lane < kDoubleLanes; ++lane)
      bits |= (lanes[lane] != 0 ? 1u : 0u) << (kDoubleLanes * i + lane);
#endif
  }
  return bits;
}

} // namespace
} // namespace packtrace::packed
