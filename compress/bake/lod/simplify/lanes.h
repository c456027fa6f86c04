#pragma once

// Four doubles in SIMD lanes, for kernels that are compiled per instruction set. All functions are inlined.

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace packtrace {
namespace {

using Lanes = double __attribute__((vector_size(32)));
using Row = double __attribute__((vector_size(32), may_alias, aligned(8))); // lanes as stored in memory

/// Four vectors.
struct Vector4 {
  Lanes x, y, z;
};

[[gnu::always_inline]] inline Vector4 load(const double (&rows)[3][4]) {
  Vector4 out;
  __builtin_memcpy(&out.x, rows[0], sizeof out.x);
  __builtin_memcpy(&out.y, rows[1], sizeof out.y);
  __builtin_memcpy(&out.z, rows[2], sizeof out.z);
  return out;
}

[[gnu::always_inline]] inline void dot(const Vector4& a, const Vector4& b, Lanes& out) {
  out = a.x * b.x + a.y * b.y + a.z * b.z;
}

[[gnu::always_inline]] inline void transpose(Lanes& v0, Lanes& v1, Lanes& v2, Lanes& v3) {
  const Lanes a = __builtin_shufflevector(v0, v1, 0, 4, 2, 6), b = __builtin_shufflevector(v0, v1, 1, 5, 3, 7);
  const Lanes c = __builtin_shufflevector(v2, v3, 0, 4, 2, 6), d = __builtin_shufflevector(v2, v3, 1, 5, 3, 7);
  v0 = __builtin_shufflevector(a, c, 0, 1, 4, 5), v1 = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  v2 = __builtin_shufflevector(a, c, 2, 3, 6, 7), v3 = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

[[gnu::always_inline]] inline void square_root(const Lanes& x, Lanes& out) {
#if defined(__AVX__)
  out = _mm256_sqrt_pd(x);
#elif defined(__SSE2__)
  const __m128d low = _mm_sqrt_pd(__builtin_shufflevector(x, x, 0, 1));
  const __m128d high = _mm_sqrt_pd(__builtin_shufflevector(x, x, 2, 3));
  out = __builtin_shufflevector(low, high, 0, 1, 2, 3);
#else
  for (int lane = 0; lane < 4; ++lane) out[lane] = __builtin_sqrt(x[lane]);
#endif
}

} // namespace
} // namespace packtrace
