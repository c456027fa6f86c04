// Compiled for AVX2. Code here must not be inline in a header: the linker might keep the AVX2 version for other
// translation units.
#include "compress/format/cluster/normal_kernels.h"

#if defined(__x86_64__)

#include <immintrin.h>

namespace packtrace::avx2 {
namespace {

constexpr uint32_t kLanes = 8;

struct Lanes {
  __m256i chart, x, y;
};

/// Packs the low halves of eight 64-bit numbers.
[[gnu::always_inline]] inline __m256i low_halves(__m256i first, __m256i second) {
  const __m256i even = _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6);
  return _mm256_blend_epi32(_mm256_permutevar8x32_epi32(first, even), _mm256_permutevar8x32_epi32(second, even), 0xf0);
}

/// Reads the fields of eight normals from `first` on. Lanes beyond the last normal repeat it.
[[gnu::always_inline]] inline Lanes read_fields(const AxisNormalStream& s, uint32_t first) {
  const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256i index = _mm256_min_epi32(_mm256_add_epi32(_mm256_set1_epi32(static_cast<int>(first)), lanes),
                                         _mm256_set1_epi32(static_cast<int>(s.count - 1)));
  const __m256i bit = _mm256_add_epi32(_mm256_mullo_epi32(index, _mm256_set1_epi32(static_cast<int>(s.stride))),
                                       _mm256_set1_epi32(static_cast<int>(s.first_bit)));
  const __m256i byte = _mm256_srli_epi32(bit, 3), skip = _mm256_and_si256(bit, _mm256_set1_epi32(7));
  const auto* bits = reinterpret_cast<const long long*>(s.bits);
  const auto mask = [](uint32_t width) {
    return _mm256_set1_epi64x(static_cast<long long>((uint64_t{1} << width) - 1));
  };
  const auto words = [&](__m128i at, __m128i by) {
    return _mm256_and_si256(_mm256_srlv_epi64(_mm256_i32gather_epi64(bits, at, 1), _mm256_cvtepu32_epi64(by)),
                            mask(s.stride));
  };
  const __m256i a = words(_mm256_castsi256_si128(byte), _mm256_castsi256_si128(skip));
  const __m256i b = words(_mm256_extracti128_si256(byte, 1), _mm256_extracti128_si256(skip, 1));
  const auto field = [&](uint32_t shift, uint32_t width, int32_t base) {
    const __m128i count = _mm_cvtsi32_si128(static_cast<int>(shift));
    const __m256i value = low_halves(_mm256_and_si256(_mm256_srl_epi64(a, count), mask(width)),
                                     _mm256_and_si256(_mm256_srl_epi64(b, count), mask(width)));
    return _mm256_add_epi32(value, _mm256_set1_epi32(base));
  };
  const uint32_t both = s.x_bits + s.y_bits;
  return {_mm256_min_epi32(field(both, s.stride - both, s.chart), _mm256_set1_epi32(5)),
          field(s.y_bits, s.x_bits, s.x_anchor), field(0, s.y_bits, s.y_anchor)};
}

[[gnu::always_inline]] inline __m256i select(__m256i mask, __m256i a, __m256i b) {
  return _mm256_blendv_epi8(b, a, mask);
}

/// fold_normal() for an axis encoding.
[[gnu::always_inline]] inline Lanes fold(const AxisNormalStream& s, const Lanes& in) {
  const __m256i zero = _mm256_setzero_si256(), last = _mm256_set1_epi32(s.last), one = _mm256_set1_epi32(1);
  const auto clamp = [&](__m256i c) { return _mm256_min_epi32(_mm256_max_epi32(c, zero), last); };
  const auto beyond = [&](__m256i c) { return _mm256_max_epi32(_mm256_sub_epi32(c, last), _mm256_sub_epi32(zero, c)); };
  const __m256i x = clamp(in.x), y = clamp(in.y), x_beyond = beyond(in.x), y_beyond = beyond(in.y);
  const __m256i along_x = _mm256_cmpgt_epi32(x_beyond, zero);
  const __m256i along_y = _mm256_andnot_si256(along_x, _mm256_cmpgt_epi32(y_beyond, zero));
  const __m256i sunk = _mm256_min_epi32(_mm256_sub_epi32(select(along_x, x_beyond, y_beyond), one), last);
  const __m256i odd = _mm256_and_si256(in.chart, one), is_odd = _mm256_cmpgt_epi32(odd, zero);
  const __m256i height = select(is_odd, sunk, _mm256_sub_epi32(last, sunk));
  const __m256i below = _mm256_srli_epi32(select(along_x, in.x, in.y), 31);
  // Advances to the next axis (along x) or the one after it (along y).
  const __m256i steps = _mm256_sub_epi32(_mm256_sub_epi32(zero, along_x), _mm256_add_epi32(along_y, along_y));
  const __m256i sum = _mm256_add_epi32(_mm256_srli_epi32(in.chart, 1), steps), three = _mm256_set1_epi32(3);
  const __m256i axis = _mm256_sub_epi32(sum, _mm256_and_si256(_mm256_cmpgt_epi32(sum, _mm256_set1_epi32(2)), three));
  const __m256i sign = select(_mm256_or_si256(along_x, along_y), below, odd);
  return {_mm256_add_epi32(_mm256_add_epi32(axis, axis), sign), select(along_x, y, select(along_y, height, x)),
          select(along_x, height, select(along_y, x, y))};
}

} // namespace

void decode_axis_normals(const AxisNormalStream& s, float* out) {
  const __m256i last = _mm256_set1_epi32(s.last), one = _mm256_set1_epi32(1);
  const __m256 scale = _mm256_set1_ps(s.scale), slope = _mm256_set1_ps(s.slope), cubic = _mm256_set1_ps(s.cubic);
  const auto warp = [&](__m256i c) {
    const __m256 t = _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_sub_epi32(_mm256_add_epi32(c, c), last)), scale);
    return _mm256_mul_ps(t, _mm256_add_ps(slope, _mm256_mul_ps(cubic, _mm256_mul_ps(t, t))));
  };
  for (uint32_t first = 0; first < s.count; first += kLanes) {
    const Lanes n = fold(s, read_fields(s, first));
    const __m256 u = warp(n.x), v = warp(n.y);
    const __m256 square = _mm256_sub_ps(_mm256_set1_ps(1.0f), _mm256_add_ps(_mm256_mul_ps(u, u), _mm256_mul_ps(v, v)));
    const __m256 sign = _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_and_si256(n.chart, one), 31));
    const __m256 w = _mm256_xor_ps(_mm256_sqrt_ps(_mm256_max_ps(square, _mm256_setzero_ps())), sign);
    const __m256i axis = _mm256_srli_epi32(n.chart, 1);
    const __m256 is_y = _mm256_castsi256_ps(_mm256_cmpeq_epi32(axis, one));
    const __m256 is_z = _mm256_castsi256_ps(_mm256_cmpgt_epi32(axis, one));
    alignas(32) float component[3][kLanes];
    _mm256_store_ps(component[0], _mm256_blendv_ps(_mm256_blendv_ps(w, v, is_y), u, is_z));
    _mm256_store_ps(component[1], _mm256_blendv_ps(_mm256_blendv_ps(u, w, is_y), v, is_z));
    _mm256_store_ps(component[2], _mm256_blendv_ps(_mm256_blendv_ps(v, u, is_y), w, is_z));
    const uint32_t count = s.count - first < kLanes ? s.count - first : kLanes;
    for (uint32_t i = 0; i < count; ++i, out += 3)
      out[0] = component[0][i], out[1] = component[1][i], out[2] = component[2][i];
  }
}

} // namespace packtrace::avx2

#endif
