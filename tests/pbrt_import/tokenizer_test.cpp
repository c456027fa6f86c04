#include "pbrt_import/text/tokenizer.h"

#include <charconv>
#include <clocale>
#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/text/number.h"
#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

Tokenizer open(const SceneFolder& folder, std::string_view text, size_t window = Tokenizer::kDefaultWindow) {
  return Tokenizer(InputFile(folder.write("text", text), 1u << 30), window);
}

/// Tokens as "kind:text@line:column", separated by spaces.
std::string listing(Tokenizer tokenizer) {
  constexpr const char* kKinds[] = {"w", "s", "[", "]", "u", "b", "l", "end"};
  std::string all;
  while (true) {
    const Token token = tokenizer.next();
    all += kKinds[static_cast<size_t>(token.kind)];
    if (token.kind == TokenKind::kWord || token.kind == TokenKind::kString) all.append(":").append(token.text);
    all.append("@").append(std::to_string(token.line)).append(":").append(std::to_string(token.column)).append(" ");
    if (token.kind == TokenKind::kEnd) return all;
  }
}

/// Appends the numbers that read_numbers() passes.
template <class T>
void read_numbers(Tokenizer& tokenizer, std::vector<T>& values) {
  tokenizer.read_numbers<T>([&](auto numbers) { values.insert(values.end(), numbers.begin(), numbers.end()); });
}

float scanned(std::string text) {
  const size_t length = text.size();
  text.resize(length + kScannerReach, '\0');
  float value = 0;
  const char* const end = scan_float(text.data(), value);
  if (end && static_cast<size_t>(end - text.data()) != length) ADD_FAILURE() << "not read to its end: " << text;
  return end ? value : parse_number<float>(std::string_view(text.data(), length)).value;
}

float reference(std::string_view text) {
  float value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

TEST(Tokenizer, TokensEndAtQuotesBracketsAndSpace) {
  const SceneFolder folder;
  EXPECT_EQ(listing(open(folder, "Shape\"sphere\"[1 2]x")),
            "w:Shape@1:1 s:sphere@1:6 [@1:14 w:1@1:15 w:2@1:17 ]@1:18 w:x@1:19 end@1:20 ");
}

TEST(Tokenizer, CommentsRunToTheEndOfTheLine) {
  const SceneFolder folder;
  EXPECT_EQ(listing(open(folder, "# one \" [\na # two\r\nb#c\n#")), "w:a@2:1 w:b#c@3:1 end@4:2 ");
}

TEST(Tokenizer, AllLineEndsCount) {
  const SceneFolder folder;
  EXPECT_EQ(listing(open(folder, "a\nb\r\nc\rd\r\re")), "w:a@1:1 w:b@2:1 w:c@3:1 w:d@4:1 w:e@6:1 end@6:2 ");
}

TEST(Tokenizer, EveryWindowSizeGivesTheSameTokens) {
  const SceneFolder folder;
  const std::string text = "Shape \"a \\\" quote\" [ 1.5 -2e3\r\n 3 ] # comment \r \"next\\\\\" Word \"open\nlast";
  const std::string whole = listing(open(folder, text));
  for (size_t window = 1; window < 80; ++window) EXPECT_EQ(listing(open(folder, text, window)), whole) << window;
}

TEST(Tokenizer, ByteOrderMarkIsSkipped) {
  const SceneFolder folder;
  EXPECT_EQ(listing(open(folder, "\xef\xbb\xbf"
                                 "Scale")),
            "w:Scale@1:1 end@1:6 ");
}

TEST(Tokenizer, Utf16IsNamed) {
  const SceneFolder folder;
  try {
    open(folder, std::string_view("\xff\xfeS\0c\0", 6));
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("UTF-16"), std::string::npos);
  }
}

TEST(Tokenizer, NulAndFfAreBadBytesNotEnds) {
  const SceneFolder folder;
  EXPECT_EQ(listing(open(folder, std::string_view("a\0b\xff"
                                                  "c",
                                                  5))),
            "w:a@1:1 b@1:2 w:b@1:3 b@1:4 w:c@1:5 end@1:6 ");
}

TEST(Tokenizer, MegabyteTokensArriveWhole) {
  const SceneFolder folder;
  const std::string word(1 << 20, 'x');
  Tokenizer tokenizer = open(folder, word + " \"" + word + "\"", 4096);
  EXPECT_EQ(tokenizer.next().text, word);
  const Token second = tokenizer.next();
  EXPECT_EQ(second.kind, TokenKind::kString);
  EXPECT_EQ(second.text, word);
}

TEST(Tokenizer, UnterminatedStringEndsWithItsLine) {
  const SceneFolder folder;
  EXPECT_EQ(listing(open(folder, "\"abc\nd")), "u@1:1 w:d@2:1 end@2:2 ");
}

TEST(Tokenizer, NumberRunsStopWhereNumbersStop) {
  const SceneFolder folder;
  for (const size_t window : {size_t{1}, size_t{100}, Tokenizer::kDefaultWindow}) {
    Tokenizer tokenizer = open(folder, "1 2.5\n-3e2\r\n 0x nan", window);
    std::vector<float> values;
    read_numbers(tokenizer, values);
    EXPECT_EQ(values, (std::vector<float>{1.0f, 2.5f, -300.0f}));
    const Token token = tokenizer.next();
    EXPECT_EQ(token.text, "0x");
    EXPECT_EQ(token.line, 3u);
    EXPECT_EQ(token.column, 2u);
  }
}

TEST(Tokenizer, LongNumberRunsAreTheSameForEveryWindow) {
  const SceneFolder folder;
  std::string text;
  for (int i = 0; i < 5000; ++i) text += std::to_string(i) + (i % 7 == 0 ? "\n" : " ");
  for (const size_t window : {size_t{1}, size_t{300}, size_t{4096}}) {
    Tokenizer tokenizer = open(folder, text, window);
    std::vector<int32_t> values;
    read_numbers(tokenizer, values);
    ASSERT_EQ(values.size(), 5000u);
    for (int i = 0; i < 5000; ++i) ASSERT_EQ(values[static_cast<size_t>(i)], i);
  }
}

/// Tokens without their kinds. Numbers appear as their values; with `bare`, read_bare_number() reads those that it can,
/// and their number is added.
std::string listing_of_values(Tokenizer tokenizer, size_t* bare) {
  std::string all;
  while (true) {
    for (double value = 0; bare && tokenizer.read_bare_number(value); ++*bare) all += std::to_string(value) + " ";
    const Token token = tokenizer.next();
    const NumberText<double> number = parse_number<double>(token.text);
    if (token.kind == TokenKind::kWord && number.used == token.text.size())
      all += std::to_string(number.value) + " ";
    else
      all.append(token.text).append("@").append(std::to_string(token.line)).append(":") += std::to_string(token.column);
    if (token.kind == TokenKind::kEnd) return all;
  }
}

TEST(Tokenizer, BareNumbersAreThoseOfTheirWords) {
  const SceneFolder folder;
  std::string text;
  for (int i = 0; i < 40; ++i)
    text.append(
            "Translate 1 -2.5\n\n 3e2 word\r\n 4# 5 # 6\n +7 .5 8\t9\r10 0x 12345678901234567890 1e99 [11]12\"13\" ")
        .append("1\0002 \n", 5);
  const std::string expected = listing_of_values(open(folder, text), nullptr);
  for (const size_t window : {size_t{1}, size_t{90}, size_t{300}, Tokenizer::kDefaultWindow}) {
    size_t bare = 0;
    EXPECT_EQ(listing_of_values(open(folder, text, window), &bare), expected) << window;
    if (window == Tokenizer::kDefaultWindow) { // reads all but those near the end
      EXPECT_GE(bare, 39u * 6u);
    }
  }
}

TEST(Number, RandomFloatsAreRoundedLikeFromChars) {
  std::mt19937_64 random(7);
  char buffer[64];
  for (int i = 0; i < 400'000; ++i) {
    const auto bits = static_cast<uint32_t>(random());
    float exact;
    std::memcpy(&exact, &bits, sizeof exact);
    if (!std::isfinite(exact)) continue;
    const int digits = static_cast<int>(random() % 18);
    const auto format = random() % 2 ? std::chars_format::scientific : std::chars_format::general;
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, exact, format, digits);
    const std::string text(buffer, end.ptr);
    const float value = scanned(text);
    ASSERT_EQ(std::memcmp(&value, &exact, 4) == 0 || value == reference(text), true) << text;
    const float expected = reference(text);
    ASSERT_EQ(std::memcmp(&value, &expected, 4), 0) << text;
  }
}

TEST(Number, PlainDecimalsAreRoundedLikeFromChars) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 400'000; ++i) {
    std::string text = std::to_string(random() % 100'000'000 >> random() % 27);
    if (random() % 4) {
      std::string fraction = std::to_string(random());
      text.append(".").append(fraction, 0, random() % (fraction.size() + 1));
    }
    if (random() % 2) text.insert(text.begin(), '-');
    const float value = scanned(text), expected = reference(text);
    ASSERT_EQ(std::memcmp(&value, &expected, 4), 0) << text;
  }
}

TEST(Number, HalfwayCasesRoundOnce) {
  // 1 + 2^-24 lies between two floats; a late digit decides, which rounding to double first would lose.
  EXPECT_EQ(scanned("1.000000059604644775390625"), 1.0f);
  EXPECT_EQ(scanned("1.0000000596046447754"), std::nextafter(1.0f, 2.0f));
  EXPECT_EQ(scanned("16777217"), 16777216.0f);
  EXPECT_EQ(scanned("16777219"), 16777220.0f);
}

TEST(Number, ExtremesSaturate) {
  EXPECT_EQ(scanned("1e400"), std::numeric_limits<float>::infinity());
  EXPECT_EQ(scanned("-1e39"), -std::numeric_limits<float>::infinity());
  EXPECT_EQ(scanned("1e-400"), 0.0f);
  EXPECT_EQ(scanned("1e99999999999999999999"), std::numeric_limits<float>::infinity());
  EXPECT_EQ(scanned("1e-99999999999999999999"), 0.0f);
  EXPECT_EQ(scanned("0." + std::string(400, '0') + "1"), 0.0f);
  EXPECT_EQ(scanned("1" + std::string(400, '0')), std::numeric_limits<float>::infinity());
  EXPECT_EQ(scanned("0." + std::string(400, '0') + "1e401"), 1.0f);
  EXPECT_EQ(scanned("1.4e-45"), std::numeric_limits<float>::denorm_min());
  EXPECT_EQ(scanned("0e400"), 0.0f);
}

TEST(Number, UncommonNotationsAreRead) {
  EXPECT_EQ(scanned("+1.5"), 1.5f);
  EXPECT_EQ(scanned(".5"), 0.5f);
  EXPECT_EQ(scanned("-.5"), -0.5f);
  EXPECT_EQ(scanned("5."), 5.0f);
  EXPECT_EQ(scanned("1E+2"), 100.0f);
  EXPECT_TRUE(std::signbit(scanned("-0")));
  EXPECT_TRUE(std::isnan(scanned("nan")));
  EXPECT_EQ(scanned("-inf"), -std::numeric_limits<float>::infinity());
  EXPECT_EQ(parse_number<float>("273,").used, 3u);
  for (const char* const text : {"", "-", "+", ".", "e5", "abc", "--1", "-+1"})
    EXPECT_EQ(parse_number<float>(text).used, 0u) << text;
}

TEST(Number, IntegersOutOfRangeAreLeftToTheSlowPath) {
  for (const char* const text : {"2147483648", "-2147483649", "99999999999999999999", "1.0", "1e3", "", "-"}) {
    std::string padded(text);
    padded.resize(padded.size() + kScannerReach, '\0');
    int32_t value = 0;
    EXPECT_EQ(scan_integer(padded.data(), value), nullptr) << text;
  }
  std::string least = "-2147483648";
  least.resize(least.size() + kScannerReach, '\0');
  int32_t value = 0;
  ASSERT_NE(scan_integer(least.data(), value), nullptr);
  EXPECT_EQ(value, INT32_MIN);
}

TEST(Number, LocaleDoesNotMatter) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  const bool changed = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
  EXPECT_EQ(scanned("1.25"), 1.25f);
  EXPECT_EQ(parse_number<double>("1.25").value, 1.25);
  std::setlocale(LC_ALL, before.c_str());
  if (!changed) GTEST_SKIP() << "no locale with a decimal comma is installed; only the default one was tried";
}

TEST(Escapes, KnownOnesAreReplacedOthersKept) {
  bool unknown = false;
  EXPECT_EQ(unescape("a\\\\b\\\"c\\n\\t", unknown), "a\\b\"c\n\t");
  EXPECT_FALSE(unknown);
  EXPECT_EQ(unescape("textures\\Tiles.png\\", unknown), "textures\\Tiles.png\\");
  EXPECT_TRUE(unknown);
}

TEST(InputFile, GzipMembersAreInflated) {
  const SceneFolder folder;
  EXPECT_EQ(listing(open(folder, gzip("Scale 1 ") + gzip("2 3"))), "w:Scale@1:1 w:1@1:7 w:2@1:9 w:3@1:11 end@1:12 ");
}

TEST(InputFile, EveryTruncatedGzipIsAnError) {
  const SceneFolder folder;
  const std::string packed = gzip("Scale 1 2 3\nTranslate 4 5 6\n");
  for (size_t size = 2; size < packed.size(); ++size)
    EXPECT_THROW(listing(open(folder, packed.substr(0, size))), Error) << size;
  EXPECT_NO_THROW(listing(open(folder, packed)));
}

TEST(InputFile, GzipBombsStopAtTheLimit) {
  const SceneFolder folder;
  const std::filesystem::path file = folder.write("bomb", gzip(std::string(1 << 20, ' ')));
  try {
    read_whole_file(file, 1000);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded);
  }
  EXPECT_EQ(read_whole_file(file, 1 << 20).size(), size_t{1} << 20);
}

TEST(Tokenizer, TokensLongerThanAnyNameHaveNoText) {
  const SceneFolder folder;
  const std::string longest(kMaxTokenBytes - 2, 'a'), too_long(2 * kMaxTokenBytes, 'a');
  EXPECT_EQ(listing(open(folder, "\"" + longest + "\" b")), "s:" + longest +
                                                                "@1:1 w:b@1:" + std::to_string(longest.size() + 4) +
                                                                " end@1:" + std::to_string(longest.size() + 5) + " ");
  for (const size_t window : {size_t{64}, Tokenizer::kDefaultWindow}) {
    EXPECT_EQ(listing(open(folder, "\"" + too_long + "\"\nb", window)), "l@1:1 w:b@2:1 end@2:2 ");
    EXPECT_EQ(listing(open(folder, too_long + "\nb", window)), "l@1:1 w:b@2:1 end@2:2 ");
    EXPECT_EQ(listing(open(folder, "\"" + too_long + "\\\"\"\nb", window)), "l@1:1 w:b@2:1 end@2:2 ");
    EXPECT_EQ(listing(open(folder, "\"" + too_long + "\nb", window)), "l@1:1 w:b@2:1 end@2:2 ");
    EXPECT_EQ(listing(open(folder, too_long, window)).substr(0, 6), "l@1:1 ");
  }
}

TEST(InputFile, OnlyRegularFilesAreRead) {
  const SceneFolder folder;
  EXPECT_THROW(InputFile(folder.path(), 100), Error);
  EXPECT_THROW(InputFile("/dev/zero", 100), Error);
  EXPECT_THROW(InputFile(folder.path() / "missing", 100), Error);
}

} // namespace
} // namespace packtrace
