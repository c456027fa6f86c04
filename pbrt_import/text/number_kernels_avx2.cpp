// Compiled for AVX2. Inline functions of headers must not be used here, because the linker could pick the AVX2 version
// for other translation units.
#include "pbrt_import/text/number_kernels.h"

#if defined(__x86_64__)

#include <immintrin.h>

namespace packtrace::avx2 {
namespace {

constexpr double kPowersOfTen[16] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                     1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
constexpr double kInversePowersOfTen[16] = {1e0,  1e-1, 1e-2,  1e-3,  1e-4,  1e-5,  1e-6,  1e-7,
                                            1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15};

alignas(64) constexpr uint8_t kTailMasks[32] = {0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0,
                                                0,    0,    0,    0,    0,    0xff, 0xff, 0xff, 0xff, 0xff, 0xff,
                                                0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff};

__m128i load16(const void* p) { return _mm_loadu_si128(static_cast<const __m128i*>(p)); }

/// Mask whose last n bytes are 0xFF and whose other bytes are 0; n within [0, 16].
__m128i last_bytes(size_t n) { return load16(kTailMasks + n); }

/// Character classes of 64 bytes: bit i is set if byte i is in the class.
struct Layout {
  uint64_t spaces;
  uint64_t line_ends; ///< LF, and CR if no LF follows
  uint64_t closes;    ///< ]
};

uint64_t mask_of(__m256i low, __m256i high) {
  return static_cast<uint32_t>(_mm256_movemask_epi8(low)) |
         static_cast<uint64_t>(static_cast<uint32_t>(_mm256_movemask_epi8(high))) << 32;
}

[[gnu::always_inline]] inline Layout layout_of(const char* p) {
  const auto load32 = [](const char* at) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(at)); };
  const __m256i low = load32(p), high = load32(p + 32);
  // A byte is white space if it equals the only white-space character with the same lower four bits. Source: Geoff
  // Langdale and Daniel Lemire, Parsing Gigabytes of JSON per Second, 2019, section 3.1.2, in a simpler case.
  const __m256i space_by_low_bits =
      _mm256_setr_epi8(' ', -1, -1, -1, -1, -1, -1, -1, -1, '\t', '\n', -1, -1, '\r', -1, -1, //
                       ' ', -1, -1, -1, -1, -1, -1, -1, -1, '\t', '\n', -1, -1, '\r', -1, -1);
  const auto spaces = [&](__m256i bytes) {
    return _mm256_cmpeq_epi8(_mm256_shuffle_epi8(space_by_low_bits, bytes), bytes);
  };
  const auto equal = [](__m256i bytes, char c) { return _mm256_cmpeq_epi8(bytes, _mm256_set1_epi8(c)); };
  Layout layout{mask_of(spaces(low), spaces(high)), mask_of(equal(low, '\n'), equal(high, '\n')),
                mask_of(equal(low, ']'), equal(high, ']'))};
  if (const uint64_t returns = mask_of(equal(low, '\r'), equal(high, '\r')))
    layout.line_ends |= returns & ~mask_of(equal(load32(p + 1), '\n'), equal(load32(p + 33), '\n'));
  return layout;
}

/// An unsigned number with at most one point.
struct Decimal {
  uint64_t mantissa;
  size_t fraction_digits;
  bool valid;
};

/// Converts all digits at once: shifts the digits before the point by one byte to close the gap, then sums pairs, fours
/// and eights.
/// @param end one past the last character
/// @param length number of characters, within [1, 16]
[[gnu::always_inline]] inline Decimal read_decimal(const char* end, size_t length) {
  const __m128i text = load16(end - 16), shifted = load16(end - 17);
  const auto points = static_cast<uint32_t>(_mm_movemask_epi8(_mm_cmpeq_epi8(text, _mm_set1_epi8('.')))) &
                      (0xFFFFu << (16 - length) & 0xFFFFu);
  const size_t has_point = points != 0;
  const size_t behind = 15 - _tzcnt_u32(points | 0x8000u); // digits after the first point
  const size_t unmoved = has_point ? behind : 16;
  const size_t digits = length - has_point;
  const __m128i joined = _mm_blendv_epi8(shifted, text, last_bytes(unmoved));
  const __m128i values = _mm_and_si128(_mm_sub_epi8(joined, _mm_set1_epi8('0')), last_bytes(digits));
  const bool all_digits = _mm_testz_si128(_mm_subs_epu8(values, _mm_set1_epi8(9)), _mm_set1_epi8(-1));
  const __m128i pairs = _mm_maddubs_epi16(values, _mm_set1_epi16(1 << 8 | 10));
  const __m128i fours = _mm_madd_epi16(pairs, _mm_set1_epi32(1 << 16 | 100));
  const __m128i eights = _mm_madd_epi16(_mm_packus_epi32(fours, fours), _mm_set1_epi32(1 << 16 | 10000));
  const auto both = static_cast<uint64_t>(_mm_cvtsi128_si64(eights));
  return {(both & 0xFFFFFFFFu) * 100'000'000u + (both >> 32), behind, all_digits && digits > 0};
}

uint64_t bits_of(double value) {
  uint64_t bits;
  __builtin_memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// Branch-free, because signs are unpredictable.
double with_sign(double magnitude, bool negative) {
  const uint64_t bits = bits_of(magnitude) | static_cast<uint64_t>(negative) << 63;
  double value;
  __builtin_memcpy(&value, &bits, sizeof value);
  return value;
}

struct ReadDouble {
  bool operator()(const char* begin, const char* end, double& value) const {
    const bool negative = *begin == '-';
    const size_t length = static_cast<size_t>(end - begin) - negative;
    if (length - 1 > 15) return false;
    const Decimal decimal = read_decimal(end, length);
    // Both operands of the division are exact, so the result is rounded once.
    value = with_sign(
        static_cast<double>(static_cast<int64_t>(decimal.mantissa)) / kPowersOfTen[decimal.fraction_digits], negative);
    return decimal.valid && decimal.mantissa <= 1ull << 53;
  }
};

struct ReadFloat {
  bool operator()(const char* begin, const char* end, float& value) const {
    const bool negative = *begin == '-';
    const size_t length = static_cast<size_t>(end - begin) - negative;
    if (length - 1 > 15) return false;
    const Decimal decimal = read_decimal(end, length);
    // Three roundings give an error below two units in the last place of a double. Rounding to float is then correct,
    // except near the middle between two floats. Sixteen digits cannot leave the range of a float.
    const double wide =
        static_cast<double>(static_cast<int64_t>(decimal.mantissa)) * kInversePowersOfTen[decimal.fraction_digits];
    constexpr uint64_t kMiddle = 0x10000000u, kMargin = 4;
    const uint64_t from_middle = (bits_of(wide) - (kMiddle - kMargin)) & 0x1FFFFFFFu;
    value = static_cast<float>(with_sign(wide, negative));
    return decimal.valid && from_middle > 2 * kMargin;
  }
};

struct ReadInteger {
  bool operator()(const char* begin, const char* end, int32_t& value) const {
    const bool negative = *begin == '-';
    const size_t length = static_cast<size_t>(end - begin) - negative;
    if (length - 1 > 7) return false; // longer integers may not fit
    uint64_t word;
    __builtin_memcpy(&word, end - 8, sizeof word);
    word = (word ^ 0x3030303030303030u) & ~uint64_t{0} << (64 - 8 * length);
    if (((word + 0x7676767676767676u) | word) & 0x8080808080808080u) return false;
    word = word * 10 + (word >> 8);
    constexpr uint64_t kPairs = 0x000000FF000000FFu;
    const auto magnitude = static_cast<int32_t>(
        ((word & kPairs) * (1'000'000ull << 32 | 100) + ((word >> 16) & kPairs) * (10'000ull << 32 | 1)) >> 32);
    const int32_t sign = -static_cast<int32_t>(negative);
    value = (magnitude ^ sign) - sign;
    return !negative || magnitude != 0;
  }
};

/// Finds the starts and ends of words for 64 bytes at once, so that their numbers can be converted independently.
template <class T, class Read>
NumberBatch convert(const char* text, const char* limit, T* values, size_t capacity, Read read) {
  NumberBatch batch;
  const char* p = text; // never inside a word
  T* value = values;
  T* const room_end = values + capacity;
  bool stopped = false;
  while (p < limit && !stopped) {
    const Layout layout = layout_of(p);
    const uint64_t gaps = layout.spaces | layout.closes;
    uint64_t starts = ~gaps & (gaps << 1 | 1);
    if (limit - p < 64) starts &= (uint64_t{1} << (limit - p)) - 1;
    uint64_t ends = gaps & ~(gaps << 1 | 1);
    if (layout.closes != 0) { // the array's end
      starts &= _blsmsk_u64(layout.closes);
      stopped = true;
    }
    size_t done = 0; // bytes of this block that are converted
    while (ends && starts) {
      const size_t begin = _tzcnt_u64(starts), end = _tzcnt_u64(ends);
      if (value == room_end || !read(p + begin, p + end, *value)) {
        stopped = true;
        break;
      }
      ++value;
      done = end;
      starts = _blsr_u64(starts);
      ends = _blsr_u64(ends);
    }
    if (done == 0) break;
    if (const uint64_t passed = layout.line_ends & (~uint64_t{0} >> (64 - done))) {
      batch.line_ends += static_cast<uint32_t>(__builtin_popcountll(passed));
      batch.last_line_end = p + 63 - __builtin_clzll(passed);
    }
    p += done;
  }
  batch.end = p;
  batch.count = static_cast<size_t>(value - values);
  return batch;
}

} // namespace

NumberBatch convert_integers(const char* text, const char* limit, int32_t* values, size_t capacity) {
  return convert(text, limit, values, capacity, ReadInteger{});
}
NumberBatch convert_floats(const char* text, const char* limit, float* values, size_t capacity) {
  return convert(text, limit, values, capacity, ReadFloat{});
}
NumberBatch convert_doubles(const char* text, const char* limit, double* values, size_t capacity) {
  return convert(text, limit, values, capacity, ReadDouble{});
}

} // namespace packtrace::avx2

#endif
