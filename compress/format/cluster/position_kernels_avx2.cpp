// Compiled for AVX2. Code here must not be inline in a header: the linker might keep the AVX2 version for other
// translation units.
#include "compress/format/cluster/position_kernels.h"

#if defined(__x86_64__)

#include <immintrin.h>

namespace packtrace::avx2 {
namespace {

constexpr uint32_t kLanes = 4;

[[gnu::always_inline]] inline __m128i load_two(const uint8_t* first, const uint8_t* second) {
  return _mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(first)),
                            _mm_loadl_epi64(reinterpret_cast<const __m128i*>(second)));
}

/// Decodes four positions, of which lanes beyond the last one repeat it, to twelve floats.
[[gnu::always_inline]] inline void decode_four(const PositionStream& s, uint32_t first, float* out) {
  uint64_t bit[kLanes];
  for (uint32_t i = 0; i < kLanes; ++i)
    bit[i] = s.first_bit + uint64_t{s.stride} * (first + i < s.count ? first + i : s.count - 1);
  const auto skip = [&](uint32_t i) { return static_cast<long long>(bit[i] & 7u); };
  const __m256i loaded = _mm256_setr_m128i(load_two(s.bits + (bit[0] >> 3), s.bits + (bit[1] >> 3)),
                                           load_two(s.bits + (bit[2] >> 3), s.bits + (bit[3] >> 3)));
  __m256i rest = _mm256_srlv_epi64(loaded, _mm256_setr_epi64x(skip(0), skip(1), skip(2), skip(3)));
  // The double with these high bits and a field as its low bits is 2^52 + field.
  const __m256d magic = _mm256_set1_pd(0x1p52);
  __m128 axis[3];
  for (uint32_t a = 0; a < 3; ++a) {
    const __m256i mask = _mm256_set1_epi64x(static_cast<long long>((uint64_t{1} << s.width[a]) - 1));
    const __m256d shifted = _mm256_or_pd(_mm256_castsi256_pd(_mm256_and_si256(rest, mask)), magic);
    const __m256d lattice = _mm256_add_pd(_mm256_sub_pd(shifted, magic), _mm256_set1_pd(s.base[a]));
    axis[a] = _mm256_cvtpd_ps(_mm256_mul_pd(lattice, _mm256_set1_pd(s.step)));
    rest = _mm256_srl_epi64(rest, _mm_cvtsi32_si128(static_cast<int>(s.width[a])));
  }
  const auto [x, y, z] = axis;
  const __m128 z0x1 = _mm_shuffle_ps(z, x, _MM_SHUFFLE(1, 1, 0, 0)),
               y1z1 = _mm_shuffle_ps(y, z, _MM_SHUFFLE(1, 1, 1, 1));
  const __m128 z2x3 = _mm_shuffle_ps(z, x, _MM_SHUFFLE(3, 3, 2, 2)),
               y3z3 = _mm_shuffle_ps(y, z, _MM_SHUFFLE(3, 3, 3, 3));
  _mm_storeu_ps(out, _mm_shuffle_ps(_mm_unpacklo_ps(x, y), z0x1, _MM_SHUFFLE(2, 0, 1, 0)));
  _mm_storeu_ps(out + 4, _mm_shuffle_ps(y1z1, _mm_unpackhi_ps(x, y), _MM_SHUFFLE(1, 0, 2, 0)));
  _mm_storeu_ps(out + 8, _mm_shuffle_ps(z2x3, y3z3, _MM_SHUFFLE(2, 0, 2, 0)));
}

} // namespace

void decode_positions(const PositionStream& s, float* out) {
  uint32_t first = 0;
  for (; first + kLanes <= s.count; first += kLanes, out += 3 * kLanes) decode_four(s, first, out);
  if (first == s.count) return;
  float four[3 * kLanes];
  decode_four(s, first, four);
  for (uint32_t i = 0; i < 3 * (s.count - first); ++i) out[i] = four[i];
}

} // namespace packtrace::avx2

#endif
