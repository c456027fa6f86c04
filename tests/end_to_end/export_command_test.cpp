// Options of `export` without effect, and the files beside the main one.

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

class ExportBench : public Workbench {
public:
  ExportBench() { bake(); }
  CommandResult exported(const std::string& output, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"export", baked(), "-o", *this / output, "-q"});
    return run_packtrace(more);
  }
  /// Names of all files and folders below the bench, sorted.
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path()))
      names.push_back(entry.path().lexically_relative(path()).string());
    std::ranges::sort(names);
    return names;
  }
};

using Words = std::vector<std::string>;

Words joined(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

const std::vector<Words> kGltfOptions = {{"--profile", "web"},   {"--codec", "draco"}, {"--level", "3"},
                                         {"--normal-bits", "9"}, {"--uv-bits", "11"},  {"--webp-psnr", "30"},
                                         {"--instancing"},       {"--levels"}};

TEST(ExportOptions, OfGltfAreErrorsForOtherFormats) {
  const ExportBench bench;
  Words all;
  for (const Words& option : kGltfOptions) all = joined(all, option);
  for (const std::string format : {"vertex16", "pbrt", "obj", "glsl", "streams"}) {
    const std::string ending = format == "vertex16" ? "v16" : format == "streams" ? "json" : format;
    const CommandResult result =
        bench.exported("x." + ending, format == "streams" ? joined({"--streams", "raw"}, all) : all);
    EXPECT_EQ(result.exit_code, 2) << format;
    EXPECT_NE(result.err.find("--profile, --codec, --level, --normal-bits, --uv-bits, --webp-psnr, --instancing and "
                              "--levels have no effect on the format " +
                              format + ", only on glTF"),
              std::string::npos)
        << result.err;
  }
  EXPECT_EQ(bench.names(), (Words{"small.pbrt", "small.ptk"}));
}

TEST(ExportOptions, OfOneCodecAreErrorsBesideOthers) {
  const ExportBench bench;
  struct Case {
    Words choice;
    std::string codec, profile; ///< profile: that chooses the codec
  };
  for (const Case& c : std::vector<Case>{{{"--codec", "draco"}, "draco", ""},
                                         {{"--codec", "meshopt"}, "meshopt", ""},
                                         {{"--codec", "none", "--profile", "web"}, "none", ""},
                                         {{"--profile", "web"}, "meshopt", " of --profile web"},
                                         {{"--profile", "portable"}, "none", " of --profile portable"},
                                         {{}, "draco", ""}}) {
    Words accepted = joined(c.choice, {"--force"});
    for (const Words& option : kGltfOptions) {
      if (option.front() == "--profile" || option.front() == "--codec") continue; // they choose
      const bool of_draco = option.front() == "--level" || option.front() == "--uv-bits";
      if (of_draco ? c.codec == "draco" : option.front() != "--normal-bits" || c.codec != "none") {
        accepted = joined(accepted, option);
        continue;
      }
      const CommandResult result = bench.exported("y.glb", joined(c.choice, option));
      EXPECT_EQ(result.exit_code, 2) << c.codec << " " << option.front();
      const std::string expected = option.front() + " has no effect on the codec " + c.codec + c.profile +
                                   ", only on draco" + (of_draco ? "\n" : " and meshopt\n");
      EXPECT_NE(result.err.find(expected), std::string::npos) << result.err << expected;
    }
    const CommandResult result = bench.exported("x.glb", accepted);
    EXPECT_EQ(result.exit_code, 0) << c.codec << c.profile << result.err;
  }
  EXPECT_FALSE(fs::exists(bench / "y.glb"));
}

TEST(ExportOptions, ValuesBeyondACodecsRangeAreErrors) {
  const ExportBench bench;
  EXPECT_EQ(bench.exported("a.glb", {"--codec", "meshopt", "--normal-bits", "20"}).exit_code, 2);
  EXPECT_EQ(bench.exported("b.glb", {"--codec", "draco", "--normal-bits", "20"}).exit_code, 0);
  EXPECT_EQ(bench.exported("c.glb", {"--codec", "meshopt", "--normal-bits", "3"}).exit_code, 2);
}

TEST(ExportedFiles, NothingIsWrittenIfOneOfThemIsThere) {
  for (const auto& [output, there] : {std::pair{"x.obj", "x.mtl"},
                                      {"x.gltf", "x.bin"},
                                      {"x.pbrt", "x_files/mesh_1_0.ply"},
                                      {"x.json", "x_files/triangles.npy"}}) {
    const ExportBench bench;
    if (fs::path(there).has_parent_path()) fs::create_directory(bench / "x_files");
    write_text(bench / there, "mine");
    const Words before = bench.names();
    const Words options = output == std::string("x.json") ? Words{"--streams", "raw"} : Words{};
    const CommandResult refused = bench.exported(output, options);
    EXPECT_EQ(refused.exit_code, 6) << output;
    EXPECT_NE(refused.err.find(bench / there + ": exists already; --force replaces it"), std::string::npos)
        << refused.err;
    EXPECT_EQ(bench.names(), before) << output;
    EXPECT_EQ(read_text(bench / there), "mine");
    EXPECT_EQ(bench.exported(output, joined(options, {"--force"})).exit_code, 0) << output;
    EXPECT_NE(read_text(bench / there), "mine");
  }
}

TEST(ExportedFiles, NothingRemainsOfAFailedExport) {
  const ExportBench bench;
  const auto limited = [&](const std::string& output, const Words& more = {}) {
    const auto limit = [] {
      const rlimit bytes{600, 600}; // meshes are smaller, the main files are not
      setrlimit(RLIMIT_FSIZE, &bytes);
    };
    return run_packtrace(joined({"export", bench.baked(), "-o", bench / output, "-q"}, more), limit);
  };
  const Words before = bench.names();
  const CommandResult failed = limited("x.pbrt");
  EXPECT_EQ(failed.exit_code, 6);
  EXPECT_NE(failed.err.find(bench / "x.pbrt"), std::string::npos) << failed.err;
  EXPECT_EQ(bench.names(), before);

  fs::create_directory(bench / "x_files"); // what was there stays
  write_text(bench / "x_files/mine", "mine");
  const Words with_folder = bench.names();
  EXPECT_EQ(limited("x.pbrt").exit_code, 6);
  EXPECT_EQ(bench.names(), with_folder);

  const std::string mesh = bench / "x_files/mesh_1_0.ply"; // and so does what would be replaced
  write_text(mesh, "mine");
  write_text(bench / "x.pbrt", "mine");
  const Words with_mesh = bench.names();
  EXPECT_EQ(limited("x.pbrt", {"--force"}).exit_code, 6);
  EXPECT_EQ(bench.names(), with_mesh);
  EXPECT_EQ(read_text(mesh), "mine");
  EXPECT_EQ(read_text(bench / "x.pbrt"), "mine");
}

TEST(ExportedFiles, LevelsThatAreMissingAreReported) {
  const ExportBench bench;
  const CommandResult result = run_packtrace({"export", bench.baked(), "-o", bench / "x.glb", "--levels"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.err.find("warning: --levels: no instance has levels of detail"), std::string::npos) << result.err;
}

TEST(ExportedFiles, ReplaceNeitherTheInputNorTheReport) {
  const ExportBench bench;
  fs::copy_file(bench.baked(), bench / "x.bin");
  const std::string input = read_text(bench / "x.bin");
  const CommandResult replaces = run_packtrace({"export", bench / "x.bin", "-o", bench / "x.gltf", "--force"});
  EXPECT_EQ(replaces.exit_code, 2);
  EXPECT_NE(replaces.err.find("x.bin: this file is read"), std::string::npos) << replaces.err;
  EXPECT_EQ(read_text(bench / "x.bin"), input);
  const CommandResult both = bench.exported("y.obj", {"--json", bench / "y.mtl"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_NE(both.err.find("y.mtl: two outputs would go to this file"), std::string::npos) << both.err;
  EXPECT_FALSE(fs::exists(bench / "y.obj"));
}

} // namespace
} // namespace packtrace::test
