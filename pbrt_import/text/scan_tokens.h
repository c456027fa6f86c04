#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "pbrt_import/text/number.h"

namespace packtrace {
namespace detail {

constexpr bool is_bad_byte(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && !is_space(c) && c != '\v' && c != '\f') || byte == 0x7f || byte == 0xff;
}

/// Bytes that do not belong in strings. Names are bytes in any encoding that contains ASCII, and 0xFF is a letter in
/// many.
constexpr bool is_bad_string_byte(char c) { return is_bad_byte(c) && static_cast<unsigned char>(c) != 0xff; }

/// Table of a predicate over all byte values.
template <class Predicate>
constexpr std::array<bool, 256> table_of(Predicate predicate) {
  std::array<bool, 256> table{};
  for (size_t i = 0; i < table.size(); ++i) table[i] = predicate(static_cast<char>(i));
  return table;
}

/// Bytes that continue a word, and bytes of a string that need no special treatment. Neither table contains the zero
/// bytes that follow a window.
inline constexpr std::array<bool, 256> kWordBytes = table_of([](char c) { return !ends_word(c) && !is_bad_byte(c); });
inline constexpr std::array<bool, 256> kPlainStringBytes =
    table_of([](char c) { return c != '"' && c != '\\' && c != '\n' && c != '\r' && !is_bad_string_byte(c); });

inline constexpr uint64_t kOnes = 0x0101010101010101u, kHighBits = 0x80 * kOnes;

// SWAR tests of eight bytes: bit 7 is set for bytes below a bound, or equal to a character. The result is exact up to
// the first such byte; later bytes, and bytes from 0x80 on, may be set wrongly.
constexpr uint64_t bytes_below(uint64_t word, uint64_t bound) { return word - bound * kOnes; }
constexpr uint64_t bytes_equal(uint64_t word, char c) { return (word ^ static_cast<unsigned char>(c) * kOnes) - kOnes; }
constexpr uint64_t bytes_from_0x7f(uint64_t word) { return word | (word + kOnes); }

/// Number of leading bytes for which the table is true.
/// @param special_bytes takes eight bytes; sets bit 7 of the first byte for which the table may be false
template <class SpecialBytes>
size_t count_while(const char* text, const std::array<bool, 256>& bytes, SpecialBytes special_bytes) {
  static_assert(kScannerReach >= sizeof(uint64_t) && std::endian::native == std::endian::little);
  const char* p = text;
  while (true) {
    uint64_t word;
    std::memcpy(&word, p, sizeof word);
    const uint64_t special = special_bytes(word) & kHighBits;
    if (special == 0) {
      p += sizeof word;
      continue;
    }
    p += std::countr_zero(special) / 8;
    if (!bytes[static_cast<unsigned char>(*p)]) return static_cast<size_t>(p - text);
    ++p;
  }
}

} // namespace detail

/// Whether a byte starts or continues a word.
inline bool is_word_byte(char c) { return detail::kWordBytes[static_cast<unsigned char>(c)]; }

/// Number of bytes from `text` on that continue a word. Text must end with kScannerReach zeros.
inline size_t count_word_bytes(const char* text) {
  using namespace detail;
  return count_while(text, kWordBytes, [](uint64_t word) {
    return bytes_below(word, '"' + 1) | bytes_equal(word, '[') | bytes_equal(word, ']') | bytes_from_0x7f(word);
  });
}

/// Number of bytes from `text` on that are part of a string and need no special treatment, in text like the above.
inline size_t count_plain_string_bytes(const char* text) {
  using namespace detail;
  return count_while(text, kPlainStringBytes, [](uint64_t word) {
    return bytes_below(word, ' ') | bytes_equal(word, '"') | bytes_equal(word, '\\') | bytes_from_0x7f(word);
  });
}

} // namespace packtrace
