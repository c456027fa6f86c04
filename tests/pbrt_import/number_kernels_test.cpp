#include "pbrt_import/text/number_kernels.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/text/number.h"

namespace packtrace {
namespace {

/// Random words separated by one or more spaces or line ends; some are not plain numbers.
class RandomText {
public:
  explicit RandomText(uint64_t seed) : random_(seed) {
    text_.assign(kKernelLead, ' ');
    for (int i = 0; i < 200; ++i) {
      add_word();
      const size_t spaces = 1 + (below(4) == 0 ? below(70) : 0);
      for (size_t k = 0; k < spaces; ++k) text_ += " \t\n\r"[below(4)];
    }
    size_ = text_.size() - kKernelLead;
    text_.append(kKernelReach, '\0');
  }
  const char* begin() const { return text_.data() + kKernelLead; }
  const char* end() const { return begin() + size_; }

private:
  uint64_t below(uint64_t bound) { return random_() % bound; }
  void digits(size_t count) {
    for (size_t i = 0; i < count; ++i) text_ += static_cast<char>('0' + below(10));
  }
  void add_word() {
    constexpr const char* kOthers[] = {"-",   ".",    "-.", "+1", "1e5", "nan",   "1.2.3", "--1",
                                       "1-2", "12a4", "]",  "1]", "#x",  "\"a\"", "1,",    "-0",
                                       "0",   "-.5",  "5.", "00", "1:2", "1/2",   "\x7f",  "16777217"};
    if (below(30) == 0) {
      text_ += kOthers[below(std::size(kOthers))];
      return;
    }
    if (below(2)) text_ += '-';
    digits(below(10));
    if (below(2)) text_ += '.';
    digits(below(9) + (below(20) == 0 ? 12 : 1));
  }

  std::mt19937_64 random_;
  std::string text_;
  size_t size_ = 0;
};

/// Checks that all numbers that a kernel converts equal those in the text.
template <class T>
void expect_right_numbers(const RandomText& text, NumberBatch (*kernel)(const char*, const char*, T*, size_t)) {
  const char* p = text.begin();
  while (p < text.end()) {
    T values[37];
    const NumberBatch batch = kernel(p, text.end(), values, std::size(values));
    uint32_t line_ends = 0;
    const char* last_line_end = nullptr;
    const auto skip_space = [&] {
      for (; p < text.end() && is_space(*p); ++p)
        if (*p == '\n' || (*p == '\r' && p[1] != '\n')) ++line_ends, last_line_end = p;
    };
    for (size_t i = 0; i < batch.count; ++i) {
      skip_space();
      const char* const end = std::find_if(p, text.end(), [](char c) { return is_space(c) || c == ']'; });
      T expected{};
      const auto [read_to, error] = std::from_chars(p, end, expected);
      ASSERT_TRUE(read_to == end && error == std::errc()) << std::string(p, end);
      ASSERT_EQ(std::memcmp(&expected, &values[i], sizeof expected), 0) << std::string(p, end) << " " << values[i];
      p = end;
    }
    if (batch.count > 0) {
      ASSERT_EQ(batch.end, p);
      ASSERT_EQ(batch.line_ends, line_ends);
      ASSERT_EQ(batch.last_line_end, last_line_end);
    }
    // Skips one word, as the caller would.
    skip_space();
    while (p < text.end() && !is_space(*p)) ++p;
  }
}

TEST(NumberKernels, GiveTheNumbersThatStandThere) {
  const NumberKernels* const kernels = number_kernels();
  if (!kernels) GTEST_SKIP() << "this processor has no AVX2";
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    const RandomText text(seed);
    expect_right_numbers<float>(text, kernels->floats);
    expect_right_numbers<double>(text, kernels->doubles);
    expect_right_numbers<int32_t>(text, kernels->integers);
    if (HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

TEST(NumberKernels, ConvertPlainNumbersWithoutHelp) {
  const NumberKernels* const kernels = number_kernels();
  if (!kernels) GTEST_SKIP() << "this processor has no AVX2";
  std::string text(kKernelLead, ' ');
  for (int i = 0; i < 1000; ++i) text += std::to_string(i * 0.37 - 100) + (i % 3 ? " " : "\r\n");
  const size_t size = text.size();
  text.append(kKernelReach, '\0');
  std::vector<float> values(2000);
  const NumberBatch batch =
      kernels->floats(text.data() + kKernelLead, text.data() + size, values.data(), values.size());
  EXPECT_EQ(batch.count, 1000u);
  EXPECT_EQ(batch.line_ends, 333u); // the last line end comes after the last number
}

TEST(NumberKernels, TakeTheNumberBeforeTheBracketAndStopThere) {
  const NumberKernels* const kernels = number_kernels();
  if (!kernels) GTEST_SKIP() << "this processor has no AVX2";
  for (size_t numbers = 1; numbers < 60; ++numbers) {
    std::string text(kKernelLead, ' ');
    for (size_t i = 0; i < numbers; ++i) text += (i > 0 ? " " : "") + std::to_string(i);
    const size_t close = text.size();
    text += "] 7 8 9 ";
    const size_t size = text.size();
    text.append(kKernelReach, '\0');
    std::vector<int32_t> values(100);
    const NumberBatch batch =
        kernels->integers(text.data() + kKernelLead, text.data() + size, values.data(), values.size());
    ASSERT_EQ(batch.count, numbers);
    ASSERT_EQ(batch.end, text.data() + close);
    ASSERT_EQ(values[numbers - 1], static_cast<int32_t>(numbers - 1));
  }
}

TEST(NumberKernels, FloatsNearTheMiddleRoundOnce) {
  const NumberKernels* const kernels = number_kernels();
  if (!kernels) GTEST_SKIP() << "this processor has no AVX2";
  std::mt19937_64 random(5);
  uint64_t converted = 0;
  for (int i = 0; i < 300'000; ++i) {
    // Sixteen digits near the middle between two neighbouring floats.
    const float low = std::bit_cast<float>(0x3c000000u + static_cast<uint32_t>(random() % 0x09000000u));
    const double middle = (static_cast<double>(low) + std::nextafter(low, 1e9f)) / 2;
    char word[64];
    const auto end =
        std::to_chars(word, word + sizeof word, middle, std::chars_format::fixed, static_cast<int>(4 + random() % 11));
    std::string text(kKernelLead, ' ');
    text.append(word, end.ptr).append(" ").append(kKernelReach, '\0');
    float value = 0, expected = 0;
    const char* const begin = text.data() + kKernelLead;
    if (kernels->floats(begin, begin + 1, &value, 1).count == 0) continue; // left to the portable scanner
    ++converted;
    std::from_chars(word, end.ptr, expected);
    ASSERT_EQ(value, expected) << std::string(word, end.ptr);
  }
  EXPECT_GT(converted, 100'000u);
}

} // namespace
} // namespace packtrace
