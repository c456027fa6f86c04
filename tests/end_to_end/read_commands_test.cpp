#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

TEST(CommandLine, EveryTruncatedPrefixOfABakedFileIsRefused) {
  const Workbench bench;
  bench.bake();
  const std::string bytes = read_text(bench.baked());
  ASSERT_GT(bytes.size(), 200u);
  // The library test tries every length; this one runs the program for some of them.
  for (size_t length = 0; length < bytes.size(); length += std::max<size_t>(1, bytes.size() / 40)) {
    write_text(bench / "cut.ptk", bytes.substr(0, length));
    const CommandResult result = run_packtrace({"info", bench / "cut.ptk"});
    EXPECT_EQ(result.exit_code, 3) << length << " of " << bytes.size() << " bytes\n" << result.err;
    EXPECT_NE(result.err.find("cut.ptk"), std::string::npos) << result.err;
  }
}

TEST(CommandLine, FlippedBitsInABakedFileAreRefused) {
  const Workbench bench;
  bench.bake();
  const std::string bytes = read_text(bench.baked());
  for (size_t i = 0; i < 40; ++i) {
    std::string damaged = bytes;
    const size_t at = i * (bytes.size() - 1) / 39;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (i % 8)));
    write_text(bench / "bad.ptk", damaged);
    const int code = run_packtrace({"info", bench / "bad.ptk"}).exit_code;
    // 4: the changed byte is in the version field
    EXPECT_TRUE(code == 3 || code == 4) << "byte " << at << " exit " << code;
  }
}

TEST(CommandLine, AnotherVersionIsUnsupported) {
  const Workbench bench;
  bench.bake();
  std::string bytes = read_text(bench.baked());
  bytes[8] = static_cast<char>(bytes[8] + 1); // FileHeader::version, docs/baked_format.md
  write_text(bench / "new.ptk", bytes);
  const CommandResult result = run_packtrace({"info", bench / "new.ptk"});
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_NE(result.err.find("version"), std::string::npos) << result.err;
}

TEST(CommandLine, CompareBeyondALimitExitsWithFive) {
  const Workbench bench;
  bench.bake();
  ASSERT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / "a.exr", "--frames", "1", "--no-denoise"}).exit_code,
            0);
  ASSERT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / "b.exr", "--frames", "64"}).exit_code, 0);
  EXPECT_EQ(run_packtrace({"compare", bench / "a.exr", bench / "a.exr", "--layer", "ao", "--max-rmse", "0"}).exit_code,
            0);
  EXPECT_EQ(run_packtrace({"compare", bench / "a.exr", bench / "b.exr", "--layer", "ao", "--max-rmse", "0"}).exit_code,
            5);
}

} // namespace
} // namespace packtrace::test
