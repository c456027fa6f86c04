#pragma once

#include <bit>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace packtrace {

/// A number at the start of a word. used is how many characters belong to it; 0: the word does not start with one.
template <class T>
struct NumberText {
  T value{};
  size_t used = 0;
};

/// Reads the longest number at the start of word: digits with an optional sign, point and exponent, or nan and inf.
/// Correctly rounded to T, float or double; too large becomes infinity, too small zero. Does not depend on the locale.
template <class T>
NumberText<T> parse_number(std::string_view word);

/// Characters that end a word in pbrt's language. NUL is not one of them, but every buffer ends with one.
constexpr bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }
constexpr bool ends_word(char c) { return is_space(c) || c == '"' || c == '[' || c == ']' || c == '\0'; }

/// Whether a word that starts with c may be a number, nan or inf.
constexpr bool may_start_number(char c) {
  return static_cast<unsigned char>(c - '0') < 10 || c == '-' || c == '+' || c == '.' || (c | 0x20) == 'n' ||
         (c | 0x20) == 'i';
}

/// How far the scanners below read ahead: the text they work on is followed by that many zeros, or goes on.
inline constexpr size_t kScannerReach = 72;

namespace detail {

inline constexpr double kPowersOfTen[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                          1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }

inline constexpr uint64_t kWholePowersOfTen[] = {1,       10,        100,        1'000,      10'000,
                                                 100'000, 1'000'000, 10'000'000, 100'000'000};

/// The digits at p, up to eight, without a loop: how long a number is cannot be predicted, and branches on it would
/// cost more than all the arithmetic.
struct DigitRun {
  uint64_t value;
  uint32_t count;
};

inline DigitRun scan_digits(const char* p) {
  static_assert(std::endian::native == std::endian::little, "the first character must be the lowest byte");
  uint64_t word;
  std::memcpy(&word, p, sizeof word);
  word ^= 0x3030303030303030u; // digits become 0..9
  // Bit 7 of each byte above 9; carries only spoil bytes after the first such one.
  const uint64_t others = ((word + 0x7676767676767676u) | word) & 0x8080808080808080u;
  const auto count = static_cast<uint32_t>(others ? std::countr_zero(others) / 8 : 8);
  const uint32_t half = 32 - 4 * count; // two shifts: one by 64 would be undefined
  word = word << half << half;          // zeros in front, the last digit in the highest byte
  word = word * 10 + (word >> 8);       // pairs in every second byte
  constexpr uint64_t kPairs = 0x000000FF000000FFu;
  const uint64_t value =
      ((word & kPairs) * (1'000'000ull << 32 | 100) + ((word >> 16) & kPairs) * (10'000ull << 32 | 1)) >> 32;
  return {value, count};
}

/// The digits behind the first eight. Stops where there are more than a mantissa holds, so that nothing reads far ahead.
inline const char* scan_more_digits(const char* p, uint64_t& mantissa) {
  for (int more = 0; more < 12 && is_digit(*p); ++more) mantissa = mantissa * 10 + static_cast<uint64_t>(*p++ - '0');
  return p;
}

} // namespace detail

/// The common form of a number, read fast: at most 19 digits, small exponent, ended by a delimiter.
/// @param p start of the number in a buffer that ends with kScannerReach zeros
/// @return one past the number, with value set to what std::from_chars would give; null: let parse_number decide
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
  if (digits == 0 || digits > 19) return nullptr; // 19 digits fit in 64 bits; with more, mantissa is worthless
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
  // Both operands are exact, so there is one rounding.
  // Source: William Clinger, How to Read Floating Point Numbers Accurately, 1990, section 4.
  if (mantissa > 1ull << 53 || exponent < -22 || exponent > 22) return nullptr;
  const double power = kPowersOfTen[exponent < 0 ? -exponent : exponent];
  const double magnitude = exponent < 0 ? static_cast<double>(mantissa) / power : static_cast<double>(mantissa) * power;
  value = negative ? -magnitude : magnitude;
  return p;
}

/// Like scan_double, rounded as if once: equal to std::from_chars to a float.
inline const char* scan_float(const char* p, float& value) {
  double wide;
  p = scan_double(p, wide);
  if (!p) return nullptr;
  // The second rounding is harmless unless the double lies exactly between two floats, or below the normal ones where
  // floats lie closer together than their bits tell.
  if ((std::bit_cast<uint64_t>(wide) & 0x1FFFFFFFu) == 0x10000000u) return nullptr;
  if (wide != 0.0 && !(std::abs(wide) >= FLT_MIN && std::abs(wide) <= FLT_MAX)) return nullptr;
  value = static_cast<float>(wide);
  return p;
}

/// Like scan_double for whole numbers that fit in 32 bits.
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
