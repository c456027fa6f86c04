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

/// How far past the place they start at the scanners below may look.
inline constexpr size_t kScannerReach = 64;

namespace detail {

inline constexpr double kPowersOfTen[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                          1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }

inline uint64_t load8(const char* p) {
  static_assert(std::endian::native == std::endian::little, "the digit tricks read little-endian words");
  uint64_t word;
  std::memcpy(&word, p, sizeof word);
  return word;
}

/// All eight bytes are '0'..'9': adding 6 must not carry a digit out of the 0x3_ row.
inline bool are_eight_digits(uint64_t word) {
  return ((word & 0xF0F0F0F0F0F0F0F0u) | (((word + 0x0606060606060606u) & 0xF0F0F0F0F0F0F0F0u) >> 4)) ==
         0x3333333333333333u;
}

/// Value of eight digits, most significant in the lowest byte: first pairs in every second byte, then all four pairs
/// weighted into the upper half of a product.
inline uint64_t eight_digits(uint64_t word) {
  word -= 0x3030303030303030u;
  word = word * 10 + (word >> 8);
  const uint64_t low = (word & 0x000000FF000000FFu) * (1'000'000ull << 32 | 100);
  const uint64_t high = ((word >> 16) & 0x000000FF000000FFu) * (10'000ull << 32 | 1);
  return (low + high) >> 32;
}

} // namespace detail

/// The common form of a number, read fast: at most 19 digits, small exponent, ended by a delimiter.
/// @param p start of the number; kScannerReach bytes from here are readable
/// @return one past the number, with value set to what std::from_chars would give; null: let parse_number decide
inline const char* scan_double(const char* p, double& value) {
  using namespace detail;
  const bool negative = *p == '-';
  p += negative;
  const char* const first = p;
  uint64_t mantissa = 0;
  int exponent = 0;
  while (is_digit(*p) && p - first < 20) mantissa = mantissa * 10 + static_cast<uint64_t>(*p++ - '0');
  std::ptrdiff_t digits = p - first;
  if (*p == '.') {
    const char* const fraction = ++p;
    if (const uint64_t word = load8(p); digits <= 11 && are_eight_digits(word))
      mantissa = mantissa * 100'000'000 + eight_digits(word), p += 8;
    while (is_digit(*p) && p - first < 22) mantissa = mantissa * 10 + static_cast<uint64_t>(*p++ - '0');
    exponent = static_cast<int>(fraction - p);
    digits += p - fraction;
  }
  if (digits == 0 || digits > 19) return nullptr; // 19 digits fit in 64 bits
  if ((*p | 0x20) == 'e') {
    ++p;
    const bool negative_exponent = *p == '-';
    p += negative_exponent || *p == '+';
    const char* const exponent_first = p;
    int written = 0;
    while (is_digit(*p) && p - exponent_first < 4) written = written * 10 + (*p++ - '0');
    if (p == exponent_first) return nullptr;
    exponent += negative_exponent ? -written : written;
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

/// Like scan_float for whole numbers that fit in 32 bits.
inline const char* scan_integer(const char* p, int32_t& value) {
  using namespace detail;
  const bool negative = *p == '-';
  p += negative;
  const char* const first = p;
  int64_t magnitude = 0;
  while (is_digit(*p) && p - first < 11) magnitude = magnitude * 10 + (*p++ - '0');
  if (p == first || !ends_word(*p)) return nullptr;
  const int64_t wide = negative ? -magnitude : magnitude;
  if (wide < INT32_MIN || wide > INT32_MAX) return nullptr;
  value = static_cast<int32_t>(wide);
  return p;
}

} // namespace packtrace
