// Behaviour common to all verbs: exit codes, options and guarantees about files, tested with the program itself.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

TEST(CommandLine, HelpNamesEveryVerb) {
  const CommandResult result = run_packtrace({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* verb : {"bake", "info", "render", "compare", "export"})
    EXPECT_NE(result.out.find(verb), std::string::npos) << verb;
}

TEST(CommandLine, NothingToDoIsAUsageError) { EXPECT_EQ(run_packtrace({}).exit_code, 2); }

TEST(CommandLine, UnknownVerbIsAUsageErrorThatNamesIt) {
  const CommandResult result = run_packtrace({"polish", "x"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("polish"), std::string::npos) << result.err;
}

TEST(CommandLine, UnknownOptionIsAUsageErrorThatNamesTheNearestOne) {
  const CommandResult result = run_packtrace({"render", "x.ptk", "-o", "x.png", "--suprsample=2"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("packtrace: error: --suprsample: no such option; did you mean --supersample?"),
            std::string::npos)
      << result.err;
  EXPECT_NE(run_packtrace({"export", "x.ptk", "y.ptk"}).err.find("y.ptk: unexpected argument"), std::string::npos);
}

TEST(CommandLine, OtherFilesThanScenesAreNamedForWhatTheyAre) {
  const Workbench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "-q"}).exit_code, 0);
  const fs::path binary = bench.path() / "picture.png";
  std::ofstream(binary) << "\x89PNG" << '\0';
  for (const auto& [file, kind] :
       {std::pair{bench.baked(), "already a baked file"}, std::pair{binary.string(), "not a text file"}}) {
    const CommandResult result = run_packtrace({"bake", file, "-o", (bench.path() / "out.ptk").string()});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find(kind), std::string::npos) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  }
}

TEST(CommandLine, OptionOutOfRangeIsAUsageErrorAndWritesNothing) {
  const Workbench bench;
  for (const auto& [option, value] :
       {std::pair{"--precision", "0"}, std::pair{"--precision", "-1"}, std::pair{"--precision", "nan"},
        std::pair{"--precision-abs", "inf"}, std::pair{"--position-bits", "0"}, std::pair{"--position-bits", "99"}}) {
    const CommandResult result = run_packtrace({"bake", bench.scene(), "-o", bench.baked(), option, value});
    EXPECT_EQ(result.exit_code, 2) << option << ' ' << value << '\n' << result.err;
  }
  EXPECT_EQ(file_count(bench.path()), 1u);
}

TEST(CommandLine, MissingInputIsAnInputErrorThatNamesTheFile) {
  const TemporaryFolder directory;
  for (const char* name : {"none.pbrt", "none.ptk"}) {
    for (const char* verb : {"info", "render", "bake"}) {
      std::vector<std::string> arguments = {verb, directory / name};
      if (arguments[0] != "info")
        arguments.insert(arguments.end(), {"-o", directory / (arguments[0] == "bake" ? "out.ptk" : "out.png")});
      const CommandResult result = run_packtrace(arguments);
      EXPECT_EQ(result.exit_code, 3) << verb << ' ' << name << '\n' << result.err;
      EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
      EXPECT_EQ(result.err.find("baked file"), std::string::npos) << result.err;
    }
  }
  EXPECT_EQ(file_count(directory.path()), 0u);
}

TEST(CommandLine, UnwritableOutputIsAnIoErrorAndLeavesNothing) {
  const Workbench bench;
  bench.bake();
  const size_t before = file_count(bench.path());
  const std::string nowhere = bench / "no/such/folder/out.";
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "-o", nowhere + "ptk"}).exit_code, 6);
  EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", nowhere + "png"}).exit_code, 6);
  EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", nowhere + "exr"}).exit_code, 6);
  EXPECT_EQ(file_count(bench.path()), before);
}

TEST(CommandLine, EmptySceneIsAnInputError) {
  const Workbench bench;
  write_text(bench / "empty.pbrt", "WorldBegin\nWorldEnd\n");
  const CommandResult baked = run_packtrace({"bake", bench / "empty.pbrt", "-o", bench / "empty.ptk"});
  EXPECT_EQ(baked.exit_code, 3) << baked.err;
  EXPECT_NE(baked.err.find("no triangles"), std::string::npos) << baked.err;
  EXPECT_FALSE(fs::exists(bench / "empty.ptk"));
}

TEST(CommandLine, QuietSaysNothingAndJsonOnStandardOutputIsAllThereIs) {
  const Workbench bench;
  const CommandResult result = run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "-q", "--json", "-"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(nlohmann::json::parse(result.out).at("triangles").get<int>(), 4);
}

} // namespace
} // namespace packtrace::test
