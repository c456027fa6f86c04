// `packtrace view` by script, as users run it.

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

/// The small scene, baked, and scripts for it.
class ViewWorkbench : public Workbench {
public:
  ViewWorkbench() { bake(); }

  CommandResult view(const std::string& script, std::vector<std::string> options = {},
                     const std::vector<std::string>& environment = {}) const {
    const std::string file = *this / "script.jsonl";
    write_text(file, script);
    options.insert(options.begin(), {"view", baked(), "--size", "64x48", "--headless", file, "--force"});
    return run_packtrace(options, environment);
  }
};

/// The JSON lines that a run printed.
std::vector<nlohmann::json> results_of(const CommandResult& result) {
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::vector<nlohmann::json> lines;
  for (size_t begin = 0; begin < result.out.size();) {
    const size_t end = std::min(result.out.find('\n', begin), result.out.size());
    lines.push_back(nlohmann::json::parse(result.out.substr(begin, end - begin)));
    begin = end + 1;
  }
  return lines;
}

std::string line(const std::string& text) { return text + "\n"; }

/// Runs the command that a view stated, with other files, and compares them.
void expect_same_files(const ViewWorkbench& bench, const nlohmann::json& screenshot) {
  auto words = screenshot.at("command").get<std::vector<std::string>>();
  ASSERT_GT(words.size(), 2u);
  EXPECT_EQ(words.front(), "packtrace");
  words.erase(words.begin());
  std::string shown;
  for (const std::string& word : words) shown += word + " ";
  words.insert(words.end(), {"-o", bench / "again.png", "-o", bench / "again.exr", "--force", "-q"});
  const CommandResult again = run_packtrace(words);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  for (const std::string& file : screenshot.at("screenshot").get<std::vector<std::string>>())
    EXPECT_EQ(read_text(file), read_text(bench / ("again" + file.substr(file.size() - 4)))) << shown;
}

TEST(ViewCommand, ScreenshotsHaveTheBytesOfTheStatedCommand) {
  const ViewWorkbench bench;
  const auto shot = [&](const std::string& name, const char* pane = "0") {
    return line("{\"screenshot\": [\"" + bench / (name + ".png") + "\", \"" + bench / (name + ".exr") +
                "\"], \"pane\": " + pane + "}");
  };
  const std::vector<std::string> setups{
      "",
      line(R"({"key": "w", "frames": 5})") + line(R"({"drag": [40, -13], "frames": 3})"),
      line(R"({"view": "variance"})") + line(R"({"set": {"ao.lambda": 3.3, "denoiser.window": 5, "seed": 4}})"),
      line(R"({"view": "ground_truth"})") + line(R"({"set": {"ao-rate": "checkerboard"}})"),
      line(R"({"view": "shaded"})") + line(R"({"set": {"supersample": 2, "jitter": "off"}})") +
          line(R"({"size": [31, 57]})"),
      line(R"({"key": "home"})") + line(R"({"set": {"ao-resolution": "quarter", "ao.radius": 0.7}})") +
          line(R"({"view": "normal"})")};
  std::string script;
  for (size_t i = 0; i < setups.size(); ++i)
    script += setups[i] + line(R"({"still": 5})") + shot("a" + std::to_string(i));
  for (const nlohmann::json& result : results_of(bench.view(script))) expect_same_files(bench, result);
}

TEST(ViewCommand, ShadedPicturesAndMovedObjectsHaveTheBytesOfTheirCommands) {
  const ViewWorkbench bench;
  const std::string scene = std::string(PACKTRACE_SOURCE_DIR) + "/assets/features/instances.pbrt";
  const std::string baked = bench / "letters.ptk";
  ASSERT_EQ(run_packtrace({"bake", scene, "-o", baked, "--for", "shading", "-q"}).exit_code, 0);
  const auto still = [&](const std::string& name) {
    return line(R"({"still": 3})") +
           line("{\"screenshot\": [\"" + bench / (name + ".png") + "\", \"" + bench / (name + ".exr") + "\"]}");
  };
  const std::string script = line(R"({"key": "3"})") + still("a") + line(R"({"key": "enter"})") +
                             line(R"({"set": {"exposure": 1, "tone-map": "aces", "shade.depth": 1}})") + still("b") +
                             line(R"({"key": "l", "frames": 5})") + line(R"({"key": "l"})") + still("c") +
                             line(R"({"select": [25, 24]})") + line(R"({"key": "u", "frames": 9})") +
                             line("{\"keys\": \"" + bench / "keys.json" + "\"}") + still("d");
  write_text(bench / "letters.jsonl", script);
  for (const std::string& file : {baked, scene}) {
    const CommandResult shown =
        run_packtrace({"view", file, "--size", "64x48", "--headless", bench / "letters.jsonl", "--force"});
    const std::vector<nlohmann::json> results = results_of(shown);
    ASSERT_EQ(results.size(), 4u);
    for (const nlohmann::json& result : results) expect_same_files(bench, result);
    EXPECT_NE(read_text(bench / "c.png"), read_text(bench / "d.png"));
  }
}

TEST(ViewCommand, TheSecondPaneHasACommandOfItsOwn) {
  const ViewWorkbench bench;
  const std::string script = line(R"({"split": "divider"})") + line(R"({"set": {"ao.radius": 0.2}, "pane": 1})") +
                             line(R"({"view": "depth", "pane": 1})") + line(R"({"still": 3})") +
                             line("{\"screenshot\": \"" + bench / "b.png" + "\", \"pane\": 1}");
  const std::vector<nlohmann::json> results = results_of(bench.view(script, {bench.scene()}));
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].at("command").at(2), bench.scene());
  expect_same_files(bench, results[0]);
}

TEST(ViewCommand, TheSameScriptGivesTheSameBytesForAnyNumberOfThreads) {
  const ViewWorkbench bench;
  const std::string script = line(R"({"split": "difference"})") + line(R"({"view": "ground_truth", "pane": 1})") +
                             line(R"({"quality": 3})") + line(R"({"key": "c"})") + line(R"({"frames": 7})") +
                             line("{\"screen\": \"" + bench / "m.png" + "\"}") + line(R"({"key": "c"})") +
                             line(R"({"still": 3})") + line("{\"screen\": \"" + bench / "s.png" + "\"}") +
                             line(R"({"metrics": true})") + line(R"({"pick": [30, 30]})");
  std::vector<std::string> bytes;
  for (const char* threads : {"1", "4"}) {
    const CommandResult result = bench.view(script, {"--threads", threads});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    bytes.push_back(result.out + read_text(bench / "m.png") + read_text(bench / "s.png"));
  }
  EXPECT_EQ(bytes[0], bytes[1]);
}

TEST(ViewCommand, PicksTellTheBytesOfTheCluster) {
  const ViewWorkbench bench;
  const std::vector<nlohmann::json> results = results_of(bench.view(line(R"({"pick": [32, 30]})")));
  const nlohmann::json& surface = results.at(0).at("pick").at("surface");
  uint64_t streams = 0;
  for (const char* stream : {"indices", "positions"}) {
    const auto bytes = surface.at("cluster_bytes").at(stream).get<uint64_t>();
    EXPECT_GT(bytes, 0u) << stream;
    streams += bytes;
  }
  EXPECT_GT(surface.at("cluster_triangles"), 0);
  EXPECT_GE(surface.at("cluster_vertices"), 3);
  EXPECT_LE(streams, std::filesystem::file_size(bench.baked()));
}

TEST(ViewCommand, RecordedPathsCanBePlayed) {
  const ViewWorkbench bench;
  const std::string path = bench / "path.json";
  results_of(bench.view(line(R"({"record": true})") + line(R"({"key": "d", "frames": 20})") +
                        line("{\"record\": \"" + path + "\"}")));
  const CommandResult played = run_packtrace({"render", bench.baked(), "--path", path, "--frames", "2", "--subframes",
                                              "1", "-o", bench / "p_%d.png", "--size", "32x24"});
  EXPECT_EQ(played.exit_code, 0) << played.err;
}

TEST(ViewCommand, ProfilesHaveARowPerFrame) {
  const ViewWorkbench bench;
  const CommandResult result = run_packtrace({"view", bench.baked(), "--size", "64x48", "--profile", "5", "--csv",
                                              bench / "p.csv", "--json", bench / "p.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("5 frames"), std::string::npos) << result.out;
  const std::string table = read_text(bench / "p.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 6);
  EXPECT_EQ(table.find("frame,total_ms,update_ms"), 0u) << table;
  const auto profile = nlohmann::json::parse(read_text(bench / "p.json")).at("profile");
  EXPECT_EQ(profile.at("list").size(), 5u);
  EXPECT_EQ(profile.at("rays").at("primary"), 5 * 64 * 48);
}

TEST(ViewCommand, MistakesInScriptsAndOptionsAreExplained) {
  const ViewWorkbench bench;
  const CommandResult wrong = bench.view(line(R"({"still": 1})") + line(R"({"viewx": "depth"})"));
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_NE(wrong.err.find("script.jsonl:2: viewx: no such field; did you mean view?"), std::string::npos) << wrong.err;
  EXPECT_EQ(run_packtrace({"view"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"view", bench.baked(), "--headless", bench / "none.jsonl"}).exit_code, 3);
  EXPECT_EQ(run_packtrace({"view", bench / "none.ptk", "--profile", "1"}).exit_code, 3);
  EXPECT_EQ(run_packtrace({"view", bench.baked(), "--csv", "a.csv"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"view", bench.baked(), "--profile", "0"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"view", bench.baked(), "--target-ms", "-1", "--profile", "1"}).exit_code, 2);
}

TEST(ViewCommand, RenderTakesAPlacedCamera) {
  const ViewWorkbench bench;
  const auto render = [&](const std::string& camera) {
    return run_packtrace(
        {"render", bench.baked(), "--camera", camera, "--frames", "1", "--force", "-q", "-o", bench / "c.png"});
  };
  EXPECT_EQ(render("lookat:0,1,-4,0,0.5,0").exit_code, 0);
  const std::string placed = read_text(bench / "c.png");
  EXPECT_EQ(render("0:lookat:0,1,-4,0,0.5,0,0,1,0,50").exit_code, 0);
  EXPECT_EQ(read_text(bench / "c.png"), placed);
  for (const char* wrong : {"lookat:", "lookat:1,2,3", "lookat:1,2,3,1,2,3", "9:lookat:0,1,-4,0,0,0",
                            "x:lookat:0,1,-4,0,0,0", "0lookat:0,1,-4,0,0,0"}) {
    const CommandResult result = render(wrong);
    EXPECT_EQ(result.exit_code, 2) << wrong;
    EXPECT_NE(result.err.find("--camera"), std::string::npos) << result.err;
  }
}

} // namespace
} // namespace packtrace::test
