// Sequences of pictures as users render them.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

/// The small scene, baked.
class SequenceBench : public Workbench {
public:
  SequenceBench() { bake(); }

  CommandResult render(const std::vector<std::string>& options) const {
    std::vector<std::string> arguments{"render", baked(), "--size", "48x32"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_packtrace(arguments);
  }
  /// The bytes of numbered pictures.
  std::vector<std::string> pictures(const std::string& name, int count) const {
    std::vector<std::string> bytes;
    for (int i = 0; i < count; ++i) bytes.push_back(read_text(*this / (name + std::to_string(i) + ".png")));
    return bytes;
  }
  std::string write_path(const std::string& text) const {
    const std::string file = *this / "path.json";
    write_text(file, text);
    return file;
  }
};

std::string keys_text(const std::string& second_key) {
  return "{\"keys\": [{\"time\": 0, \"position\": [0, 1, -3], \"look\": [0, 1, 0]},\n" + second_key + "]}";
}

const std::string kSecondKey = "{\"time\": 1, \"position\": [1, 1, -3], \"look\": [0, 1, 0]}";

TEST(Sequences, PathsGiveNumberedPictures) {
  const SequenceBench bench;
  const std::string path = bench.write_path(keys_text(kSecondKey));
  for (const std::string name : {"orbit:30", "turntable", "scene", path.c_str()}) {
    const CommandResult result =
        bench.render({"--path", name, "--frames", "3", "--subframes", "2", "-o", bench / "a_%03d.png", "--force",
                      "--csv", bench / "a.csv", "--json", bench / "a.json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const char* file : {"a_000.png", "a_001.png", "a_002.png"})
      EXPECT_GT(std::filesystem::file_size(bench / file), 100u);
    EXPECT_FALSE(std::filesystem::exists(bench / "a_%03d.png.resume"));
    const std::string table = read_text(bench / "a.csv");
    EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 4);
    const auto report = nlohmann::json::parse(read_text(bench / "a.json")).at("sequence");
    EXPECT_EQ(report.at("pictures"), 3);
    EXPECT_EQ(report.at("list").size(), 3u);
    EXPECT_EQ(report.at("list")[0].at("rays").at("primary"), 48 * 32); // two frames share a shift
  }
  EXPECT_NE(bench.pictures("a_00", 3)[0], bench.pictures("a_00", 3)[2]);
}

TEST(Sequences, AFilesLengthIsThatOfItsKeys) {
  const SequenceBench bench;
  const CommandResult result = bench.render({"--path", bench.write_path(keys_text(kSecondKey)), "--fps", "5", "-o",
                                             bench / "a%d.png", "--subframes", "1", "-q"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(std::filesystem::exists(bench / "a4.png"));
  EXPECT_FALSE(std::filesystem::exists(bench / "a5.png"));
}

TEST(Sequences, BytesDoNotDependOnTheNumberOfThreads) {
  const SequenceBench bench;
  for (const char* threads : {"1", "3"}) {
    const std::string pattern = bench / (std::string("t") + threads + "_%d.png");
    ASSERT_EQ(bench
                  .render({"--path", "orbit:20", "--frames", "4", "--subframes", "3", "-o", pattern, "--threads",
                           threads, "-q"})
                  .exit_code,
              0);
  }
  EXPECT_EQ(bench.pictures("t1_", 4), bench.pictures("t3_", 4));
}

TEST(Sequences, ResumedOnesHaveTheSameBytes) {
  const SequenceBench bench;
  const auto render = [&](const std::string& pattern, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"render",   bench.baked(),   "--size", "48x32",       "--path",
                                       "orbit:20", "--frames",      "6",      "--subframes", "3",
                                       "-o",       bench / pattern, "-q",     "--ao-rate",   "adaptive"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_packtrace(arguments);
  };
  ASSERT_EQ(render("whole%d.png", {}).exit_code, 0);
  // Pictures 0 and 1 are finished when picture 2 cannot be written.
  std::filesystem::create_directory(bench / "part2.png");
  EXPECT_EQ(render("part%d.png", {"--checkpoint", "0", "--force"}).exit_code, 6);
  std::filesystem::remove(bench / "part2.png");
  EXPECT_TRUE(std::filesystem::exists(bench / "part1.png"));
  EXPECT_FALSE(std::filesystem::exists(bench / "part2.png"));
  ASSERT_TRUE(std::filesystem::exists(bench / "part%d.png.resume"));
  // Other options are refused.
  const CommandResult other = render("part%d.png", {"--resume", "--spp", "2"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("other options"), std::string::npos) << other.err;
  EXPECT_EQ(render("part%d.png", {"--resume", "--aov", "depth"}).exit_code, 2);
  EXPECT_EQ(render("part%d.png", {"--resume", "--ao-set", "lambda=3"}).exit_code, 2);
  const CommandResult rest = render("part%d.png", {"--resume", "--json", bench / "rest.json"});
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(nlohmann::json::parse(read_text(bench / "rest.json")).at("sequence").at("rendered"), 4);
  EXPECT_EQ(bench.pictures("part", 6), bench.pictures("whole", 6));
  EXPECT_FALSE(std::filesystem::exists(bench / "part%d.png.resume"));
  // A damaged state is refused; nothing but a state is resumed from the start.
  write_text(bench / "part%d.png.resume", "PTKSEQ1\nnonsense, nonsense, nonsense, nonsense");
  EXPECT_EQ(render("part%d.png", {"--resume"}).exit_code, 3);
  std::filesystem::remove(bench / "part%d.png.resume");
  EXPECT_EQ(render("part%d.png", {"--resume"}).exit_code, 0);
  EXPECT_EQ(bench.pictures("part", 6), bench.pictures("whole", 6));
}

/// A quad that bends, in three frames, above another.
std::string bent_quad(double height) {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 2\nproperty list uchar int vertex_indices\nend_header\n-1 0 0\n1 0 0\n1 0 2\n-1 " +
         std::to_string(height) + " 2\n3 0 1 2\n3 0 2 3\n";
}

TEST(Sequences, DeformingMeshesArePlayed) {
  const SequenceBench bench;
  for (int i = 0; i < 3; ++i) write_text(bench / ("bend_" + std::to_string(i) + ".ply"), bent_quad(0.5 * i));
  write_text(bench / "bend.pbrt",
             "LookAt 0 2 -3  0 0 1  0 1 0\nCamera \"perspective\"\nFilm \"image\" \"integer xresolution\" 48 "
             "\"integer yresolution\" 32\nWorldBegin\nShape \"plymesh\" \"string filename\" \"bend_0.ply\"\n"
             "Translate 0 -0.5 0\nScale 3 1 3\nShape \"plymesh\" \"string filename\" \"bend_0.ply\"\nWorldEnd\n");
  const std::string file = bench / "bend.ptk";
  const CommandResult baked = run_packtrace(
      {"bake", bench / "bend.pbrt", "-o", file, "-q", "--sequence", bench / "bend_%d.ply", "--sequence-fps", "2"});
  ASSERT_EQ(baked.exit_code, 0) << baked.err;
  const auto render = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"render",   file, "--path",      "scene", "--fps", "2",
                                       "--frames", "3",  "--subframes", "2",     "-q",    "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_packtrace(arguments);
  };
  ASSERT_EQ(render({"-o", bench / "b%d.png"}).exit_code, 0);
  const std::vector<std::string> pictures = bench.pictures("b", 3);
  EXPECT_NE(pictures[0], pictures[1]);
  EXPECT_NE(pictures[1], pictures[2]);
  // The same after an interruption.
  std::filesystem::create_directory(bench / "r1.png");
  EXPECT_EQ(render({"-o", bench / "r%d.png", "--checkpoint", "0"}).exit_code, 6);
  std::filesystem::remove(bench / "r1.png");
  ASSERT_EQ(render({"-o", bench / "r%d.png", "--resume"}).exit_code, 0);
  EXPECT_EQ(bench.pictures("r", 3), pictures);
  const CommandResult embree = render({"-o", bench / "e%d.png", "--backend", "embree"});
  EXPECT_EQ(embree.exit_code, 4);
  EXPECT_NE(embree.err.find("backend packed"), std::string::npos) << embree.err;
}

TEST(Sequences, VideoHasAFrameForEachPicture) {
  const SequenceBench bench;
  const std::vector<std::string> common{"--path",      "orbit:20", "--frames", "3",
                                        "--subframes", "1",        "--fps",    "29.97002997"};
  std::vector<std::string> file = common, stream = common, images = common;
  file.insert(file.end(), {"-o", bench / "v.y4m", "-q"});
  ASSERT_EQ(bench.render(file).exit_code, 0);
  const std::string video = read_text(bench / "v.y4m");
  const std::string header = "YUV4MPEG2 W48 H32 F30000:1001 Ip A1:1 C444\n";
  EXPECT_EQ(video.substr(0, header.size()), header);
  EXPECT_EQ(video.size(), header.size() + 3 * (6 + 3 * 48 * 32));
  stream.insert(stream.end(), {"-o", "-"});
  EXPECT_EQ(bench.render(stream).out, video);
  images.insert(images.end(), {"-o", "-", "--stream", "png"});
  const std::string pngs = bench.render(images).out;
  size_t count = 0;
  for (size_t at = pngs.find("\x89PNG"); at != std::string::npos; at = pngs.find("\x89PNG", at + 1)) ++count;
  EXPECT_EQ(count, 3u);
}

TEST(Sequences, BadOptionsAreExplained) {
  const SequenceBench bench;
  const auto refused = [&](const std::vector<std::string>& options, int code, const std::string& text) {
    const CommandResult result = bench.render(options);
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
  };
  const std::string good = bench / "x_%04d.png";
  refused({"--path", "orbit", "-o", bench / "x.png"}, 2, "needs the number");
  refused({"--path", "orbit", "-o", bench / "x_%d_%d.png"}, 2, "two places");
  refused({"--path", "orbit", "-o", bench / "x_%s.png"}, 2, "not d");
  refused({"--path", "orbit", "--frames", "101", "-o", bench / "x_%02d.png"}, 2, "0 to 99");
  refused({"--path", "orbit", "--frames", "0", "-o", good}, 2, "--frames 0");
  refused({"--path", "orbit:fast", "-o", good}, 2, "orbit:90");
  refused({"--path", "spiral", "-o", good}, 2, "turntable");
  refused({"--path", bench / "none.json", "-o", good}, 3, "none.json");
  refused({"--path", "orbit", "--fps", "0", "-o", good}, 2, "--fps");
  refused({"--path", "orbit", "--subframes", "0", "-o", good}, 2, "--subframes");
  refused({"--fps", "24", "-o", bench / "x.png"}, 2, "--path");
  refused({"--path", "orbit", "--resume", "-o", bench / "x.y4m"}, 2, "--resume");
  refused({"--path", "orbit", "--ground-truth", "-o", good}, 2, "--ground-truth");
  refused({"--path", "orbit", "--stream", "png", "-o", good}, 2, "--stream");
  write_text(bench / "x_0001.png", "mine");
  refused({"--path", "orbit", "--frames", "3", "-o", good}, 6, "x_0001.png");
  EXPECT_EQ(read_text(bench / "x_0001.png"), "mine");
}

TEST(Sequences, BadPathFilesAreExplained) {
  const SequenceBench bench;
  const auto refused = [&](const std::string& text, const std::string& message) {
    const CommandResult result =
        bench.render({"--path", bench.write_path(text), "-o", bench / "x_%04d.png", "--frames", "2"});
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("path.json"), std::string::npos) << result.err;
  };
  refused("", "path.json:1:1");
  refused("{\"keys\": [\n  {\"time\": 0, ]}", "path.json:2:");
  refused("[]", "object");
  refused("{\"keys\": []}", "two keys");
  refused(keys_text("").replace(keys_text("").rfind(",\n"), 2, ""), "two keys");
  refused(keys_text("{\"time\": 1, \"position\": [1, 1], \"look\": [0, 1, 0]}"), "position");
  refused(keys_text("{\"time\": 1, \"position\": [1, 1, 2], \"lok\": [0, 1, 0]}"), "lok");
  refused(keys_text("{\"position\": [1, 1, 2], \"look\": [0, 1, 0]}"), "time");
  refused(keys_text("{\"time\": 0, \"position\": [1, 1, 2], \"look\": [0, 1, 0]}"), "time");
  refused(keys_text("{\"time\": 1, \"position\": [1, 1, 1e999], \"look\": [0, 1, 0]}"), "path.json");
  refused(keys_text("{\"time\": 1, \"position\": [0, 1, 0], \"look\": [0, 1, 0]}"), "own position");
}

} // namespace
} // namespace packtrace::test
