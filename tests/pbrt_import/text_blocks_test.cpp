#include "pbrt_import/text/text_blocks.h"

#include <random>

#include <oneapi/tbb/global_control.h>

#include "pbrt_import/text/number.h"
#include "pbrt_import/text/tokenizer.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

TextBlock block_of(std::string_view text) {
  TextBlock block;
  block.text.assign(text.begin(), text.end());
  block.text.resize(text.size() + 256, '\0');
  block.size = text.size();
  block.last = true;
  find_number_runs(block, text.size());
  return block;
}

/// Number runs as "kind begin-end xCOUNT".
std::string runs_of(std::string_view text) {
  std::string all;
  for (const NumberRun& run : block_of(text).runs) {
    all += "ifd"[static_cast<size_t>(run.kind)];
    all.append(std::to_string(run.begin)).append("-").append(std::to_string(run.end));
    all.append(" x").append(std::to_string(run.count)).append("; ");
  }
  return all;
}

TEST(NumberRuns, DeclarationsSayWhatTheNumbersAre) {
  EXPECT_EQ(runs_of("\"integer i\" [1 2] \"float f\" [ 1 2 ] Transform [1 2]"), "i13-16 x2; f29-34 x2; d47-50 x2; ");
}

TEST(NumberRuns, WithoutADeclarationWholeNumbersAreIntegers) {
  EXPECT_EQ(runs_of("1 2 3]"), "i0-5 x3; ");
  EXPECT_EQ(runs_of("1 2 3.5]"), "f0-7 x3; ");
  EXPECT_EQ(runs_of("-0 1]"), "f0-4 x2; "); // as an integer it would lose its sign
}

TEST(NumberRuns, GoOnBehindWhatIsNoPlainNumber) {
  EXPECT_EQ(runs_of("\"float f\" [1 nan 3 # x\n4 5]"), "f11-13 x1; f16-19 x1; f24-26 x1; ");
}

TEST(NumberRuns, EndWithTheirArray) { EXPECT_EQ(runs_of("\"float f\" [1] 2 3 \"float g\" [\"a\" 4]"), "f11-12 x1; "); }

/// All tokens and numbers of a file; numbers come from runs if possible.
std::string reading_of(const std::filesystem::path& path, size_t window, uint64_t& numbers_in_runs) {
  Tokenizer tokenizer(InputFile(path, 1u << 30), window);
  std::string all;
  while (true) {
    tokenizer.read_numbers<float>([&](auto numbers) {
      numbers_in_runs += numbers.size();
      for (const auto number : numbers) all.append(std::to_string(static_cast<float>(number))).append(" ");
    });
    const Token token = tokenizer.next();
    if (token.kind == TokenKind::kEnd) break;
    float number = 0;
    if (token.kind == TokenKind::kWord && scan_float(token.text.data(), number))
      all.append(std::to_string(number));
    else
      all.append(token.text);
    all.append(" ");
  }
  return all + std::to_string(tokenizer.next().line);
}

std::string large_scene(size_t arrays) {
  std::mt19937 random(3);
  std::string text;
  for (size_t i = 0; i < arrays; ++i) {
    text += "Shape \"x\" \"float f\" [";
    for (size_t k = random() % 2000; k > 0; --k) {
      text += std::to_string(static_cast<int>(random() % 100'000) - 50'000);
      if (random() % 2) text += ".25";
      text += random() % 10 ? " " : "\r\n";
      if (random() % 500 == 0) text += "# a comment [ 1 2\n";
    }
    text += "] \"string s\" \"a [ b\"\n";
  }
  return text;
}

TEST(TextBlocks, EveryBlockSizeReadsTheSame) {
  const SceneFolder folder;
  const std::filesystem::path file = folder.write("text", large_scene(6));
  uint64_t in_runs = 0, ignored = 0;
  const std::string whole = reading_of(file, 1u << 20, in_runs);
  EXPECT_GT(in_runs, 1000u);
  for (const size_t window : {1, 2, 63, 64, 65, 100, 255, 256, 257, 300, 1000, 4096, 5000})
    ASSERT_EQ(reading_of(file, window, ignored) == whole, true) << window;
}

TEST(TextBlocks, EveryThreadCountReadsTheSame) {
  const SceneFolder folder;
  const std::filesystem::path file = folder.write("text", large_scene(300)); // large enough for helper threads
  std::vector<std::string> readings;
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{4}}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism, threads);
    uint64_t in_runs = 0;
    readings.push_back(reading_of(file, 20'000, in_runs));
    EXPECT_GT(in_runs, 100'000u);
  }
  EXPECT_EQ(readings[0] == readings[1], true);
  EXPECT_EQ(readings[0] == readings[2], true);
}

TEST(TextBlocks, ReadersMayStopAnywhere) {
  const SceneFolder folder;
  const std::filesystem::path file = folder.write("text", large_scene(300));
  for (int blocks = 0; blocks < 20; ++blocks) {
    TextBlocks reader(InputFile(file, 1u << 30), 20'000);
    for (uint64_t number = 0; number < static_cast<uint64_t>(blocks); ++number)
      EXPECT_EQ(reader.at(number).offset, number * 20'000);
  }
}

} // namespace
} // namespace packtrace
