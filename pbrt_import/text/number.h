#pragma once

#include <bit>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace packtrace {

/// A number at the start of a word. `used` is the number of characters that belong to it, 0 if the word does not start
/// with a number.
template <class T>
struct NumberText {
  T value{};
  size_t used = 0;
};

/// Parses the longest number at the start of a word: digits with an optional sign, point and exponent, or nan and inf.
/// Correctly rounded to T, which is float or double; overflow gives infinity, underflow 0. Independent of the locale.
template <class T>
NumberText<T> parse_number(std::string_view word);

/// Characters that end a word in pbrt's language, plus NUL, with which every buffer ends.
constexpr bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }
constexpr bool ends_word(char c) { return is_space(c) || c == '"' || c == '[' || c == ']' || c == '\0'; }

/// Whether a word that starts with c may be a number, nan or inf.
constexpr bool may_start_number(char c) {
  return static_cast<unsigned char>(c - '0') < 10 || c == '-' || c == '+' || c == '.' || (c | 0x20) == 'n' ||
         (c | 0x20) == 'i';
}

/// Number of readable bytes that the scanners below need behind the start of a number: more text or zeros.
inline constexpr size_t kScannerReach = 72;

namespace detail {

inline constexpr double kPowersOfTen[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                          1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }

inline constexpr uint64_t kWholePowersOfTen[] = {1,       10,        100,        1'000,      10'000,
                                                 100'000, 1'000'000, 10'000'000, 100'000'000};

/// Result of scan_digits(), which reads up to eight digits without a branch: the length of a number is unpredictable,
/// so mispredicted branches would cost more than all the arithmetic.
struct DigitRun {
  uint64_t value;
  uint32_t count;
};

inline DigitRun scan_digits(const char* p) {
  static_assert(std::endian::native == std::endian::little, "the first character must be the lowest byte");
  uint64_t word;
  std::memcpy(&word, p, sizeof word);
  word ^= 0x3030303030303030u; // digits become 0..9
  // Sets bit 7 of each byte above 9. Carries can only corrupt bytes after the first such byte.
  const uint64_t others = ((word + 0x7676767676767676u) | word) & 0x8080808080808080u;
  const auto count = static_cast<uint32_t>(others ? std::countr_zero(others) / 8 : 8);
  const uint32_t half = 32 - 4 * count; // two shifts, because a shift by 64 is undefined
  word = word << half << half;          // leading zeros, with the last digit in the highest byte
  word = word * 10 + (word >> 8);       // two-digit values in every second byte
  constexpr uint64_t kPairs = 0x000000FF000000FFu;
  const uint64_t value =
      ((word & kPairs) * (1'000'000ull << 32 | 100) + ((word >> 16) & kPairs) * (10'000ull << 32 | 1)) >> 32;
  return {value, count};
}

/// Reads the digits after the first eight. Stops after 12, which is more than the mantissa can hold, to bound the
/// read-ahead.
inline const char* scan_more_digits(const char* p, uint64_t& mantissa) {
  for (int more = 0; more < 12 && is_digit(*p); ++more) mantissa = mantissa * 10 + static_cast<uint64_t>(*p++ - '0');
  return p;
}

} // namespace detail

/// Fast parser for the common form of a number: at most 19 digits and a small exponent, followed by a delimiter.
/// @param p start of the number, with kScannerReach readable bytes
/// @param value set to the result of std::from_chars
/// @return one past the number; null if parse_number() has to be used instead
inline const char* scan_double(const char* p, double& value) {
  using namespace detail;
  const bool negative = *p == '-';
  p += negative;
  const char* const first = p;
  DigitRun run = scan_digits(p);
  uint64_t mantissa = run.value;
  p += run.count;
  if (run.count == 8) p = scan_more_digits(p, mantissa);
  std::ptrdiff_t digits = p - first, exponent = 0;
  if (*p == '.') {
    const char* const fraction = ++p;
    run = scan_digits(p);
    mantissa = mantissa * kWholePowersOfTen[run.count] + run.value;
    p += run.count;
    if (run.count == 8) p = scan_more_digits(p, mantissa);
    exponent = fraction - p;
    digits += p - fraction;
  }
  if (digits == 0 || digits > 19) return nullptr; // 19 digits fit in 64 bits; the mantissa overflows with more
  if ((*p | 0x20) == 'e') {
    ++p;
    const bool negative_exponent = *p == '-';
    p += negative_exponent || *p == '+';
    run = scan_digits(p);
    if (run.count == 0 || run.count == 8) return nullptr;
    p += run.count;
    exponent += negative_exponent ? -static_cast<std::ptrdiff_t>(run.value) : static_cast<std::ptrdiff_t>(run.value);
  }
  if (!ends_word(*p)) return nullptr;
  // Both operands are exact, so the result is rounded once.
  // Source: William Clinger, How to Read Floating Point Numbers Accurately, 1990, section 4.
  if (mantissa > 1ull << 53 || exponent < -22 || exponent > 22) return nullptr;
  const double power = kPowersOfTen[exponent < 0 ? -exponent : exponent];
  const double magnitude = exponent < 0 ? static_cast<double>(mantissa) / power : static_cast<double>(mantissa) * power;
  value = negative ? -magnitude : magnitude;
  return p;
}

/// Like scan_double(), for float: the result equals that of std::from_chars for a float, without double rounding.
inline const char* scan_float(const char* p, float& value) {
  double wide;
  p = scan_double(p, wide);
  if (!p) return nullptr;
  // Rounding twice is only wrong if the double lies exactly in the middle between two floats, or in the range of
  // subnormal floats, whose spacing this bit test does not cover.
  if ((std::bit_cast<uint64_t>(wide) & 0x1FFFFFFFu) == 0x10000000u) return nullptr;
  if (wide != 0.0 && !(std::abs(wide) >= FLT_MIN && std::abs(wide) <= FLT_MAX)) return nullptr;
  value = static_cast<float>(wide);
  return p;
}

/// Like scan_double(), for integers that fit in 32 bits.
inline const char* scan_integer(const char* p, int32_t& value) {
  using namespace detail;
  const bool negative = *p == '-';
  p += negative;
  const DigitRun run = scan_digits(p);
  auto magnitude = static_cast<int64_t>(run.value);
  p += run.count;
  for (int more = 0; run.count == 8 && more < 3 && is_digit(*p); ++more) magnitude = magnitude * 10 + (*p++ - '0');
  if (run.count == 0 || !ends_word(*p)) return nullptr;
  const int64_t wide = negative ? -magnitude : magnitude;
  if (wide < INT32_MIN || wide > INT32_MAX) return nullptr;
  value = static_cast<int32_t>(wide);
  return p;
}

} // namespace packtrace
