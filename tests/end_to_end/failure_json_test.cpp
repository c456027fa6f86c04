#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

/// Runs with --json - and returns the "error" object.
nlohmann::json error_of(std::vector<std::string> words, const std::vector<std::string>& environment = {}) {
  words.insert(words.end(), {"--json", "-"});
  const CommandResult result = run_packtrace(words, environment);
  const auto document = nlohmann::json::parse(result.out, nullptr, false);
  if (document.is_discarded() || !document.contains("error")) {
    ADD_FAILURE() << words[0] << ": " << result.out;
    return {};
  }
  const auto& error = document.at("error");
  EXPECT_EQ(error.at("exit_code"), result.exit_code);
  EXPECT_NE(result.err.find(error.at("message").get<std::string>()), std::string::npos) << result.err;
  EXPECT_EQ(error.size(), 6u);
  return error;
}

TEST(FailureJson, EveryKindOfFailureIsWritten) {
  const Workbench bench;
  bench.bake();
  EXPECT_EQ(error_of({"info", bench / "none.ptk"}).at("kind"), "input");
  EXPECT_EQ(error_of({"bake", bench.scene(), "-o", bench.baked()}).at("kind"), "io");
  EXPECT_EQ(error_of({"render", bench.baked(), "-o", bench / "a.png", "--camera", "9"}).at("kind"), "usage");
  EXPECT_EQ(error_of({"view", bench.baked()}, {"DISPLAY="}).at("kind"), "unsupported");
}

TEST(FailureJson, UsageErrorsAreWrittenToo) {
  const Workbench bench;
  for (const auto& words : std::vector<std::vector<std::string>>{{"rendr"},
                                                                 {},
                                                                 {"info"},
                                                                 {"info", "x", "--unknown"},
                                                                 {"render", "x.ptk", "-o", "x.png", "--frames", "q"},
                                                                 {"bake", "x.pbrt", "-o", "x.glb"},
                                                                 {"info", "x", "--threads", "0"}}) {
    std::vector<std::string> with_file = words;
    with_file.insert(with_file.end(), {"--json=" + (bench / "e.json"), "--force"});
    const CommandResult result = run_packtrace(with_file);
    EXPECT_EQ(result.exit_code, 2);
    const auto document = nlohmann::json::parse(read_text(bench / "e.json"));
    EXPECT_EQ(document.at("error").at("kind"), "usage");
    EXPECT_TRUE(document.at("error").at("file").is_null());
  }
}

TEST(FailureJson, ThePlaceIsKeptInParts) {
  const Workbench bench;
  const std::string scene = bench / "odd: 7:8: name.pbrt";
  std::string text = small_scene_text();
  text.insert(text.find("WorldEnd"), "Shape \"plymesh\" \"string filename\" [\"gone.ply\"]\n");
  write_text(scene, text);
  const auto strict = error_of({"info", scene, "--strict"});
  EXPECT_EQ(strict.at("file"), scene);
  EXPECT_EQ(strict.at("line"), 8);
  EXPECT_GT(strict.at("column"), 0);
  const auto missing = error_of({"info", bench / "none.ptk"});
  EXPECT_EQ(missing.at("file"), bench / "none.ptk");
  EXPECT_TRUE(missing.at("line").is_null());
  write_text(bench / "bad.ptk", "PACKTRACE or not");
  EXPECT_EQ(error_of({"info", bench / "bad.ptk"}).at("file"), bench / "bad.ptk");
  EXPECT_EQ(error_of({"info", bench / "none.pbrt"}).at("file"), bench / "none.pbrt");
  EXPECT_EQ(error_of({"bake", bench.scene(), "-o", bench.scene() + ".d/x.ptk"}).at("file"), bench.scene() + ".d/x.ptk");
}

TEST(FailureJson, AFileThatIsThereStaysWithoutForce) {
  const Workbench bench;
  write_text(bench / "mine.json", "mine");
  EXPECT_EQ(run_packtrace({"info", bench / "none.ptk", "--json", bench / "mine.json"}).exit_code, 6);
  EXPECT_EQ(read_text(bench / "mine.json"), "mine");
  // Even --force replaces only reports: a mistyped name may be that of a mesh.
  EXPECT_EQ(run_packtrace({"info", bench / "none.ptk", "--json", bench / "mine.json", "--force"}).exit_code, 3);
  EXPECT_EQ(read_text(bench / "mine.json"), "mine");
  write_text(bench / "mine.json", "{}");
  EXPECT_EQ(run_packtrace({"info", bench / "none.ptk", "--json", bench / "mine.json", "--force"}).exit_code, 3);
  EXPECT_EQ(nlohmann::json::parse(read_text(bench / "mine.json")).at("verb"), "info");
}

TEST(FailureJson, ComparisonsBeyondALimitKeepWhatWasMeasured) {
  const Workbench bench;
  for (const char* seed : {"1", "2"})
    ASSERT_EQ(run_packtrace({"render", bench.scene(), "-o", bench / (std::string(seed) + ".exr"), "--frames", "1",
                             "--no-denoise", "--seed", seed})
                  .exit_code,
              0);
  const CommandResult result =
      run_packtrace({"compare", bench / "1.exr", bench / "2.exr", "--max-rmse", "0", "--json", "-"});
  EXPECT_EQ(result.exit_code, 5);
  const auto document = nlohmann::json::parse(result.out);
  EXPECT_EQ(document.at("error").at("kind"), "limit_exceeded");
  EXPECT_FALSE(document.at("passed"));
  EXPECT_GT(document.at("metrics").at("rmse"), 0.0);
}

} // namespace
} // namespace packtrace::test
