// Compiled for AVX2. Code here must not be inline in a header: the linker might keep the AVX2 version for other
// translation units.
#include "compress/format/pages/page_fast_kernels.h"

#if defined(__x86_64__)

#include <immintrin.h>

namespace packtrace::page_fast::avx2 {
namespace {

[[gnu::always_inline]] inline __m128i count_of(uint32_t bits) { return _mm_cvtsi32_si128(static_cast<int>(bits)); }
[[gnu::always_inline]] inline __m256i mask_of(uint32_t bits) {
  return _mm256_set1_epi64x(static_cast<long long>((uint64_t{1} << bits) - 1));
}

struct Field {
  const uint8_t* bytes;
  __m128i low_bits, low_at, shift;
  __m256i low_mask;
};

/// Processes four vertices per step, so up to three words behind the last one are written.
template <uint32_t kCount>
[[gnu::always_inline]] inline void sum_fields(const ChannelCode& code, uint32_t count, uint64_t* out) {
  Field fields[kCount];
  for (uint32_t f = 0; f < kCount; ++f) {
    const FieldCode& field = code.fields[f];
    fields[f] = {field.bytes, count_of(field.low_bits), count_of(field.low_at), count_of(field.shift),
                 mask_of(field.low_bits)};
  }
  const __m256i one = _mm256_set1_epi64x(1), seven = _mm256_set1_epi64x(7);
  const auto stride = static_cast<long long>(code.low_stride), first = static_cast<long long>(code.low_bit);
  __m256i bit = _mm256_setr_epi64x(first, first + stride, first + 2 * stride, first + 3 * stride);
  const __m256i step = _mm256_set1_epi64x(4 * stride);
  for (uint32_t i = 0; i < count; i += 4) {
    __m256i low = _mm256_setzero_si256();
    if (stride != 0) {
      low = _mm256_i64gather_epi64(reinterpret_cast<const long long*>(code.low), _mm256_srli_epi64(bit, 3), 1);
      low = _mm256_srlv_epi64(low, _mm256_and_si256(bit, seven));
      bit = _mm256_add_epi64(bit, step);
    }
    __m256i word = _mm256_setzero_si256();
    for (const Field& field : fields) {
      const __m256i high = _mm256_cvtepu8_epi64(_mm_loadu_si32(field.bytes + i));
      const __m256i below = _mm256_and_si256(_mm256_srl_epi64(low, field.low_at), field.low_mask);
      const __m256i zigzag_number = _mm256_or_si256(_mm256_sll_epi64(high, field.low_bits), below);
      const __m256i sign = _mm256_sub_epi64(_mm256_setzero_si256(), _mm256_and_si256(zigzag_number, one));
      const __m256i value = _mm256_xor_si256(_mm256_srli_epi64(zigzag_number, 1), sign);
      word = _mm256_add_epi64(word, _mm256_sll_epi64(value, field.shift));
    }
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + i), word);
  }
}

} // namespace

void read_residuals(const ChannelCode& code, uint32_t count, uint64_t* out) {
  if (code.field_count == 3)
    sum_fields<3>(code, count, out);
  else if (code.field_count == 2)
    sum_fields<2>(code, count, out);
  else
    sum_fields<1>(code, count, out);
}

} // namespace packtrace::page_fast::avx2

#endif
