#include "pbrt_import/text/number.h"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <type_traits>

#include "tests/sanitized.h"
#include <gtest/gtest.h>

namespace packtrace {
namespace {

const uint64_t kShare = test::sanitized() ? 50 : 1; // they slow each value down by more than ten times

/// Numbers of values in all tests together, without sanitizers.
constexpr uint64_t kRandomBits = 4'000'000, kDecimals = 4'000'000, kHalfway = 1'200'000, kEdges = 500'000,
                   kLong = 100'000, kIntegers = 1'000'000;
static_assert(kRandomBits + kDecimals + kHalfway + kEdges + kLong + kIntegers >= 10'000'000);

using Random = std::mt19937_64;

uint64_t below(Random& random, uint64_t bound) { return random() % bound; }

/// A text, a delimiter, and the zeros that the scanners require.
class NumberBuffer {
public:
  void clear() { size_ = 0; }
  NumberBuffer& add(char c) {
    text_[size_++] = c;
    return *this;
  }
  NumberBuffer& add(std::string_view more) {
    std::memcpy(text_.data() + size_, more.data(), more.size());
    size_ += more.size();
    return *this;
  }
  template <class T>
  NumberBuffer& add_number(T value) {
    return take(std::to_chars(text_.data() + size_, text_.data() + text_.size(), value));
  }
  NumberBuffer& add_number(double value, std::chars_format format, int precision) {
    return take(std::to_chars(text_.data() + size_, text_.data() + text_.size(), value, format, precision));
  }
  void digits(Random& random, size_t count) {
    for (size_t i = 0; i < count; ++i) add(static_cast<char>('0' + below(random, 10)));
  }
  void end(char delimiter) {
    text_[size_] = delimiter;
    std::memset(text_.data() + size_ + 1, 0, kScannerReach);
  }
  const char* data() const { return text_.data(); }
  std::string_view view() const { return {text_.data(), size_}; }

private:
  NumberBuffer& take(std::to_chars_result result) {
    size_ = static_cast<size_t>(result.ptr - text_.data());
    return *this;
  }
  std::array<char, 4096> text_{};
  size_t size_ = 0;
};

template <class T>
bool same_bits(T a, T b) {
  using Bits = std::conditional_t<sizeof(T) == 4, uint32_t, uint64_t>;
  return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

/// Reference value, correctly rounded by the standard library. If std::from_chars reports a value out of range, strtod
/// (or strtof) tells whether it overflows or underflows.
template <class T>
T reference(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  EXPECT_EQ(end, text.data() + text.size()) << text;
  if (error == std::errc()) return value;
  const std::string copy(text);
  if constexpr (std::is_same_v<T, float>)
    return std::strtof(copy.c_str(), nullptr);
  else
    return std::strtod(copy.c_str(), nullptr);
}

/// Counts how many numbers took the fast path, so that a test that never takes it fails.
struct Tally {
  uint64_t all = 0;
  uint64_t scanned = 0;
};

const char* scan(const char* text, float& value) { return scan_float(text, value); }
const char* scan(const char* text, double& value) { return scan_double(text, value); }

template <class T>
bool check_type(const NumberBuffer& buffer, Tally& tally) {
  const std::string_view text = buffer.view();
  const T expected = reference<T>(text);
  T scanned{};
  ++tally.all;
  if (const char* const end = scan(buffer.data(), scanned)) {
    ++tally.scanned;
    if (end != text.data() + text.size() || !same_bits(scanned, expected)) {
      ADD_FAILURE() << "scanned \"" << text << "\" as " << scanned << ", not " << expected;
      return false;
    }
  }
  const NumberText<T> parsed = parse_number<T>(text);
  if (parsed.used != text.size() || !same_bits(parsed.value, expected)) {
    ADD_FAILURE() << "parsed \"" << text << "\" as " << parsed.value << ", not " << expected;
    return false;
  }
  return true;
}

/// Checks the scanner and the parser for both types.
bool check(NumberBuffer& buffer, Tally& tally, char delimiter = ' ') {
  buffer.end(delimiter);
  return check_type<float>(buffer, tally) && check_type<double>(buffer, tally);
}

TEST(NumberParsing, RandomBitPatternsComeBack) {
  Random random(1);
  NumberBuffer buffer;
  Tally tally;
  for (uint64_t i = 0; i < kRandomBits / kShare; ++i) {
    buffer.clear();
    const uint64_t bits = random();
    if (i % 2) {
      const auto value = std::bit_cast<float>(static_cast<uint32_t>(bits));
      if (!std::isfinite(value)) continue;
      buffer.add_number(value);
    } else {
      const auto value = std::bit_cast<double>(bits);
      if (!std::isfinite(value)) continue;
      if (i % 4)
        buffer.add_number(value);
      else
        buffer.add_number(value, std::chars_format::scientific, static_cast<int>(below(random, 18)));
    }
    if (!check(buffer, tally)) return;
  }
  EXPECT_GT(tally.scanned, 0u);
}

TEST(NumberParsing, DecimalsAsScenesHaveThem) {
  Random random(2);
  NumberBuffer buffer;
  Tally tally;
  constexpr char kDelimiters[] = {' ', '\n', '\t', '\r', ']', '"', '\0'};
  for (uint64_t i = 0; i < kDecimals / kShare; ++i) {
    buffer.clear();
    const uint64_t bits = random();
    if (bits & 1) buffer.add('-');
    if (bits & 6 && (bits & 0x78) == 0) buffer.add(std::string_view("0000000000", below(random, 10)));
    buffer.digits(random, (bits & 6 ? 1 : 0) + below(random, 9));
    if (buffer.view().empty() || buffer.view() == "-" || bits & 0x180) {
      buffer.add('.');
      buffer.digits(random, 1 + below(random, 11));
    }
    if ((bits & 0xe00) == 0) {
      buffer.add(bits & 0x1000 ? 'e' : 'E');
      if (bits & 0x2000) buffer.add(bits & 0x4000 ? '-' : '+');
      buffer.add_number(below(random, 40));
    }
    if (!check(buffer, tally, kDelimiters[below(random, std::size(kDelimiters))])) return;
  }
  EXPECT_GT(tally.scanned, tally.all / 2) << "most numbers of scenes are to be read the fast way";
}

TEST(NumberParsing, HalfwayBetweenFloats) {
  Random random(3);
  NumberBuffer buffer;
  Tally tally;
  for (uint64_t i = 0; i < kHalfway / kShare / 3; ++i) {
    // Between 2^-40 and 2^40, so that the exact decimal expansions are short.
    const auto bits = static_cast<uint32_t>((87 + below(random, 80)) << 23 | (random() & 0x7fffff));
    const double low = std::bit_cast<float>(bits), high = std::bit_cast<float>(bits + 1);
    const double middle = 0.5 * (low + high); // exact
    for (const double value : {middle, std::nextafter(middle, low), std::nextafter(middle, high)}) {
      buffer.clear();
      buffer.add_number(value, std::chars_format::scientific, 64);
      if (!check(buffer, tally)) return;
      if (value != middle) continue;
      buffer.clear();
      buffer.add_number(value, std::chars_format::general, 17);
      if (!check(buffer, tally)) return;
    }
  }
}

TEST(NumberParsing, HalfwayBetweenDoubles) {
  Random random(4);
  NumberBuffer buffer;
  Tally tally;
  for (uint64_t i = 0; i < kLong / kShare / 2; ++i) {
    // (2 m + 1) 2^-k, where m has 53 bits: halfway between two doubles. Its decimals are those of an integer divided by
    // 10^k.
    const auto value = static_cast<long double>((uint64_t{1} << 52 | (random() >> 12)) << 1 | 1);
    const long double middle = std::ldexp(value, -static_cast<int>(below(random, 60)));
    for (const char* const behind : {"", "0", "00000000000000000000000000000001", "1"}) {
      buffer.clear();
      char text[256];
      const auto [end, error] = std::to_chars(text, text + sizeof text, middle, std::chars_format::fixed, 60);
      ASSERT_EQ(error, std::errc());
      buffer.add(std::string_view(text, static_cast<size_t>(end - text))).add(behind);
      if (!check(buffer, tally)) return;
    }
  }
}

TEST(NumberParsing, EdgesOfTheRange) {
  Random random(5);
  NumberBuffer buffer;
  Tally tally;
  for (uint64_t i = 0; i < kEdges / kShare; ++i) {
    buffer.clear();
    if (i % 2) buffer.add('-');
    buffer.digits(random, 1);
    buffer.add('.');
    buffer.digits(random, below(random, 20));
    buffer.add('e');
    // Around the ends of the ranges of float and double, and around the largest exact power of ten.
    constexpr int kExponents[] = {-324, -308, -46, -45, -38, -22, 22, 38, 39, 308, 309};
    buffer.add_number(kExponents[below(random, std::size(kExponents))] + static_cast<int>(below(random, 5)) - 2);
    if (!check(buffer, tally)) return;
  }
}

TEST(NumberParsing, NumbersAtTheEdgesOfTheRange) {
  NumberBuffer buffer;
  Tally tally;
  for (const char* const text : {"3.4028234e38",
                                 "3.4028235e38",
                                 "3.40282356e38",
                                 "3.4028235677973366e38",
                                 "3.4028235677973367e38",
                                 "1.17549435e-38",
                                 "1.1754943e-38",
                                 "1.4e-45",
                                 "7.006492321624085e-46",
                                 "7.006492321624086e-46",
                                 "1.7976931348623157e308",
                                 "1.7976931348623159e308",
                                 "2.2250738585072014e-308",
                                 "2.2250738585072011e-308",
                                 "5e-324",
                                 "2.4703282292062327e-324",
                                 "2.4703282292062328e-324",
                                 "9007199254740991",
                                 "9007199254740992",
                                 "9007199254740993",
                                 "9007199254740993e1",
                                 "9007199254740993e-22",
                                 "9007199254740992e22",
                                 "1e22",
                                 "1e23",
                                 "9223372036854775807",
                                 "9999999999999999999",
                                 "18446744073709551615",
                                 "18446744073709551616",
                                 "0.000000000000000000000000000000000000000000001",
                                 "00000000000000000000000000000000001.5",
                                 "1e0000000000000000000000000000000000001",
                                 "0e999",
                                 "-0e-999",
                                 "1e-9999999",
                                 "1e9999999",
                                 "1e-99999999999999999999",
                                 "1e99999999999999999999",
                                 "0.0",
                                 "-0.0",
                                 "0",
                                 "8388609.5",
                                 "16777217",
                                 "16777219",
                                 "33554435"}) {
    buffer.clear();
    buffer.add(text);
    EXPECT_TRUE(check(buffer, tally)) << text;
  }
}

TEST(NumberParsing, LongMantissas) {
  Random random(6);
  NumberBuffer buffer;
  Tally tally;
  for (uint64_t i = 0; i < kLong / kShare / 2; ++i) {
    const size_t length = 17 + below(random, i % 10 ? 30 : 784), point = below(random, length + 1);
    buffer.clear();
    if (i % 5 == 0) buffer.add(std::string_view("0.000000000000000000000000000000"));
    const bool has_point = i % 5 == 0;
    buffer.digits(random, has_point ? length : point);
    if (!has_point) {
      buffer.add('.');
      buffer.digits(random, length - point);
    }
    if (buffer.view() == ".") continue;
    if (i % 3 == 0) buffer.add('e').add_number(static_cast<int>(below(random, 700)) - 350);
    if (!check(buffer, tally)) return;
  }
}

TEST(NumberParsing, IntegersOfAnyLength) {
  Random random(7);
  NumberBuffer buffer;
  uint64_t scanned = 0, refused = 0;
  for (uint64_t i = 0; i < kIntegers / kShare; ++i) {
    buffer.clear();
    if (i % 3 == 0) buffer.add('-');
    if (i % 16 == 0) buffer.add(std::string_view("000000000000", below(random, 12)));
    const auto value = static_cast<uint64_t>(i % 4 ? random() >> below(random, 64) : 2147483640 + below(random, 20));
    buffer.add_number(value);
    buffer.end(" ]\n"[i % 3]);
    const std::string_view text = buffer.view();
    int32_t expected = 0, found = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), expected);
    const char* const after = scan_integer(buffer.data(), found);
    if (!after) {
      // Numbers of more than ten digits may be left to the slow path, shorter ones that fit may not.
      const size_t digits = text.size() - (text[0] == '-');
      ASSERT_TRUE(error == std::errc::result_out_of_range || digits > 10) << text;
      ++refused;
      continue;
    }
    ++scanned;
    ASSERT_EQ(error, std::errc()) << text;
    ASSERT_EQ(after, text.data() + text.size()) << text;
    ASSERT_EQ(found, expected) << text;
  }
  EXPECT_GT(scanned, refused / 4);
  EXPECT_GT(refused, 0u);
}

TEST(NumberParsing, WhatIsNoNumberIsLeftAlone) {
  for (const char* const text :
       {"", "-", "+", ".", "-.", "e5", ".e5", "abc", "--1", "-+1", "+-1", "++1", "#1", "[1", "\"1\"", " 1", "\0001"}) {
    std::string padded(text);
    padded.resize(padded.size() + kScannerReach, '\0');
    float narrow;
    double wide;
    int32_t integer;
    EXPECT_EQ(scan_float(padded.data(), narrow), nullptr) << text;
    EXPECT_EQ(scan_double(padded.data(), wide), nullptr) << text;
    EXPECT_EQ(scan_integer(padded.data(), integer), nullptr) << text;
    EXPECT_EQ(parse_number<float>(text).used, 0u) << text;
    EXPECT_EQ(parse_number<double>(text).used, 0u) << text;
  }
}

TEST(NumberParsing, ScannersLeaveOddEndsToTheParser) {
  struct Case {
    const char* text;
    size_t used; ///< characters that parse_number() uses
  };
  for (const Case& c : {Case{"1,5", 1},
                        {"1.2.3", 3},
                        {"1e", 1},
                        {"1e+", 1},
                        {"0x10", 1},
                        {"1f", 1},
                        {"1-2", 1},
                        {"1e5e5", 3},
                        {"nan", 3},
                        {"inf", 3},
                        {"-infinity", 9},
                        {"1#", 1},
                        {"1\v2", 1}}) {
    std::string padded(c.text);
    padded.resize(padded.size() + kScannerReach, '\0');
    float narrow;
    double wide;
    EXPECT_EQ(scan_float(padded.data(), narrow), nullptr) << c.text;
    EXPECT_EQ(scan_double(padded.data(), wide), nullptr) << c.text;
    EXPECT_EQ(parse_number<float>(c.text).used, c.used) << c.text;
    EXPECT_EQ(parse_number<double>(c.text).used, c.used) << c.text;
  }
}

} // namespace
} // namespace packtrace
