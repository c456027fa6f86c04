// Options and words that other programs accept: each one works, or is refused with a hint at what to type instead.

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Habits, BakeRefusesTheEndingOfAnotherFormat) {
  const Workbench bench;
  for (const char* name : {"a.glb", "a.GLB", "a.gltf", "a.v16", "a.png", "a.exr", "a.pbrt", "a.obj", "a.json"}) {
    const CommandResult result = run_packtrace({"bake", bench.scene(), "-o", bench / name});
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_TRUE(contains(result.err, ".ptk")) << result.err;
    EXPECT_FALSE(fs::exists(bench / name));
  }
  const CommandResult gltf = run_packtrace({"bake", "a.pbrt", "-o", "my room.glb"});
  EXPECT_TRUE(contains(gltf.err, "bake to 'my room.ptk', then packtrace export 'my room.ptk' -o 'my room.glb'"))
      << gltf.err;
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench / "a.PTK", "-q"}).exit_code, 0);
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench / "v1.2", "-q"}).exit_code, 0) << "no format's ending";
}

TEST(Habits, OtherOutputsRefuseTheEndingOfAnotherFormatToo) {
  const Workbench bench;
  bench.bake();
  const std::string bytes = read_text(bench.baked());
  EXPECT_EQ(run_packtrace({"export", bench.baked(), "-o", bench / "a.ptk", "--layout", "gltf"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"export", bench.baked(), "-o", bench / "a.glb", "--layout", "vertex16"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"export", bench.baked(), "-o", bench / "a.v16", "--layout", "gltf"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"info", bench.scene(), "--json", bench.baked(), "--force"}).exit_code, 2);
  EXPECT_EQ(read_text(bench.baked()), bytes);
}

TEST(Habits, DashIsStandardOutput) {
  const Workbench bench;
  bench.bake();
  const CommandResult baked = run_packtrace({"bake", bench.scene(), "-o", "-"}, {}, bench.path());
  EXPECT_EQ(baked.exit_code, 0) << baked.err;
  EXPECT_EQ(baked.out, read_text(bench.baked()));
  EXPECT_TRUE(contains(baked.err, "standard output: import")) << baked.err;
  ASSERT_EQ(run_packtrace({"export", bench.baked(), "-o", bench / "a.glb", "-q"}).exit_code, 0);
  EXPECT_EQ(run_packtrace({"export", bench.baked(), "-o", "-", "--layout", "gltf"}).out, read_text(bench / "a.glb"));
  EXPECT_EQ(run_packtrace({"export", bench.baked(), "-o", "-"}).exit_code, 2) << "which layout?";
  ASSERT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / "a.png", "--frames", "1"}).exit_code, 0);
  const CommandResult rendered = run_packtrace({"render", bench.baked(), "-o", "-", "--frames", "1"});
  EXPECT_EQ(rendered.out, read_text(bench / "a.png"));
  EXPECT_TRUE(contains(rendered.err, "mean ao")) << rendered.err;
  EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", "-", "--aov", "all"}).exit_code, 2);
  for (const char* verb : {"bake", "render"})
    EXPECT_EQ(run_packtrace({verb, bench.scene(), "-o", "-", "--json", "-"}).exit_code, 2) << verb;
  EXPECT_FALSE(fs::exists(bench / "-"));
}

TEST(Habits, PicturesMayBeAListWithCommas) {
  const Workbench bench;
  const CommandResult result =
      run_packtrace({"render", bench.scene(), "-o", "x.png,y.EXR", "-o", "z,1.PNG", "--frames", "1"}, {}, bench.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* name : {"x.png", "y.EXR", "z,1.PNG"}) EXPECT_TRUE(fs::exists(bench / name)) << name;
  EXPECT_EQ(file_count(bench.path()), 4u);
}

TEST(Habits, OptionsOfEveryVerbMayStandBeforeIt) {
  const Workbench bench;
  const CommandResult result =
      run_packtrace({"-q", "--threads", "1", "--json", "-", "bake", bench.scene(), "--dry-run", "-v"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(nlohmann::json::parse(result.out).at("requirements").contains("geometries")) << "-v counts";
  EXPECT_EQ(run_packtrace({"--threads=0", "info", bench.scene()}).exit_code, 2);
  const CommandResult forgotten = run_packtrace({"--json", "info", bench.scene()}, {}, bench.path());
  EXPECT_EQ(forgotten.exit_code, 2);
  EXPECT_TRUE(contains(forgotten.err, "--json needs a value, but info follows")) << forgotten.err;
  EXPECT_FALSE(fs::exists(bench / "info"));
}

TEST(Habits, HelpAndVersionAreVerbsToo) {
  const std::string version = run_packtrace({"--version"}).out;
  EXPECT_TRUE(version.starts_with("packtrace ")) << version;
  EXPECT_EQ(run_packtrace({"-V"}).out, version);
  EXPECT_EQ(run_packtrace({"version"}).out, version);
  EXPECT_EQ(run_packtrace({"help"}).out, run_packtrace({"--help"}).out);
  EXPECT_EQ(run_packtrace({"help", "bake"}).out, run_packtrace({"bake", "--help"}).out);
  EXPECT_EQ(run_packtrace({"render", "x.ptk", "--size", "3", "-h"}).out, run_packtrace({"help", "render"}).out);
  const CommandResult unknown = run_packtrace({"help", "rendr"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_TRUE(contains(unknown.err, "did you mean render?")) << unknown.err;
}

TEST(Habits, MisspeltNamesAreAnsweredWithTheNearestOne) {
  for (const auto& [words, nearest] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"rendr", "x.ptk"}, "render"},
           {{"-q", "exprot"}, "export"},
           {{"--vrsion"}, "--version"},
           {{"bake", "x.pbrt", "-o", "x.ptk", "--codec", "smal"}, "small"},
           {{"bake", "x.pbrt", "-o", "x.ptk", "--lod", "instancd"}, "instanced"},
           {{"render", "x.ptk", "-o", "x.png", "--backend", "embre"}, "embree"},
           {{"render", "x.ptk", "-o", "x.png", "--background", "lightgreen"}, ""},
           {{"render", "x.ptk", "-o", "x.png", "--background", "transparant"}, "transparent"}}) {
    const CommandResult result = run_packtrace(words);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(contains(result.err, "; did you mean " + nearest + "?"), !nearest.empty()) << result.err;
  }
}

TEST(Habits, AFileWithoutAVerbIsAnsweredWithWhatToType) {
  const Workbench bench;
  EXPECT_TRUE(contains(run_packtrace({"a/my room.pbrt"}).err,
                       "packtrace bake 'a/my room.pbrt' -o 'my room.ptk', or packtrace info 'a/my room.pbrt'"));
  EXPECT_TRUE(contains(run_packtrace({"-q", "x.ptk"}).err, "packtrace render x.ptk -o x.png"));
}

TEST(Habits, AVerbWithoutOutputIsAnsweredWithWhatToType) {
  for (const auto& [words, command] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"bake", "a/room.pbrt"}, "packtrace bake a/room.pbrt -o room.ptk"},
           {{"render", "room.ptk"}, "packtrace render room.ptk -o room.png"},
           {{"export", "room.ptk"}, "packtrace export room.ptk -o room.glb"}}) {
    const CommandResult result = run_packtrace(words);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(contains(result.err, "needs -o FILE, for example: " + command)) << result.err;
  }
}

TEST(Habits, LevelsOfDetailNeedNoValue) {
  const Workbench bench;
  write_text(bench.scene(), "WorldBegin\nShape \"sphere\"\nWorldEnd\n");
  const auto levels = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"bake", "--json", "-", "--force", "-o", bench.baked()});
    const CommandResult result = run_packtrace(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 && !nlohmann::json::parse(result.out).at("lod").is_null();
  };
  EXPECT_TRUE(levels({"--lod", bench.scene()})) << "the scene is no value";
  EXPECT_TRUE(levels({bench.scene(), "--lod"}));
  EXPECT_TRUE(levels({bench.scene(), "--lod", "all"}));
  EXPECT_TRUE(levels({bench.scene(), "--lod=all"}));
  EXPECT_FALSE(levels({bench.scene(), "--lod", "instanced"})) << "nothing is instanced";
  EXPECT_FALSE(levels({"--lod", "off", "--", bench.scene()}));
  EXPECT_FALSE(levels({bench.scene()}));
}

TEST(Habits, AnOptionIsNoValueOfAnother) {
  const Workbench bench;
  for (const auto& words : std::vector<std::vector<std::string>>{{"info", bench.scene(), "--json", "--force"},
                                                                 {"bake", bench.scene(), "-o", "-q"},
                                                                 {"bake", bench.scene(), "-o", "--", "x.ptk"},
                                                                 {"info", bench.scene(), "--json"}}) {
    const CommandResult result = run_packtrace(words, {}, bench.path());
    EXPECT_EQ(result.exit_code, 2) << words.back();
    EXPECT_TRUE(contains(result.err, " needs a value")) << result.err;
  }
  EXPECT_EQ(file_count(bench.path()), 1u);
}

TEST(Habits, EqualsSignsAndRepeatedOptionsAreTaken) {
  const Workbench bench;
  const CommandResult result = run_packtrace(
      {"render", bench.scene(), "-o=x.png", "--size=8x8", "--size", "12x10", "--frames", "3", "--frames=1", "--json=-"},
      {}, bench.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report.at("width"), 12);
  EXPECT_EQ(report.at("frames"), 1) << "the last one counts";
  EXPECT_TRUE(fs::exists(bench / "x.png"));
  const CommandResult two = run_packtrace({"bake", bench.scene(), "-o", bench / "a.ptk", "-o", bench / "b.ptk"});
  EXPECT_EQ(two.exit_code, 2) << "one of them would be lost";
  EXPECT_TRUE(contains(two.err, "given 2 times")) << two.err;
}

TEST(Habits, SizesAreTakenInEveryWayPeopleWriteThem) {
  const Workbench bench;
  for (const auto& size : std::vector<std::vector<std::string>>{{"14x9"}, {"14X9"}, {"14,9"}, {"14", "9"}}) {
    std::vector<std::string> words{"render",  "--frames", "1", "-o",    bench / "x.png",
                                   "--force", "--json",   "-", "--size"};
    words.insert(words.end(), size.begin(), size.end());
    words.push_back(bench.scene());
    const CommandResult result = run_packtrace(words);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(nlohmann::json::parse(result.out).at("height"), 9);
  }
  const CommandResult wrong = run_packtrace({"render", bench.scene(), "-o", bench / "y.png", "--size", "14"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_TRUE(contains(wrong.err, "1280x720")) << wrong.err;
}

TEST(Habits, AnEmptyWordIsNoFile) { // for example an unset variable in quotes
  for (const auto& words : std::vector<std::vector<std::string>>{{""}, {"info", ""}, {"compare", "a.png", ""}}) {
    const CommandResult result = run_packtrace(words);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(contains(result.err, "argument is empty")) << result.err;
  }
}

TEST(Habits, NumbersThatAreNoneAreNamed) {
  const CommandResult result = run_packtrace({"render", "x.ptk", "-o", "x.png", "--frames", "many"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(contains(result.err, "--frames: 'many' is not a valid number")) << result.err;
}

TEST(Habits, ThreadsMayBeSetForAllCommands) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const Workbench bench;
  const auto info = [&](const char* value, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"info", bench.scene()});
    return run_packtrace(more, {"PACKTRACE_THREADS=" + std::string(value)});
  };
  for (const char* good : {"1", "3", "1024", ""}) EXPECT_EQ(info(good).exit_code, 0) << good;
  for (const char* bad : {"0", "-1", "1025", "many", "2 ", "99999999999"}) {
    EXPECT_EQ(info(bad).exit_code, 2) << bad;
    EXPECT_TRUE(contains(info(bad).err, "PACKTRACE_THREADS")) << info(bad).err;
    EXPECT_EQ(info(bad, {"--threads", "2"}).exit_code, 0) << "the option wins";
  }
  EXPECT_TRUE(contains(run_packtrace({"--help"}).out, "PACKTRACE_THREADS"));
}

TEST(Habits, InfoTakesSeveralFiles) {
  const Workbench bench;
  bench.bake();
  const CommandResult table = run_packtrace({"info", bench.baked(), bench.scene()});
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_EQ(std::ranges::count(table.out, '\n'), 3) << table.out; // a heading and one line per file
  const CommandResult data = run_packtrace({"info", bench.baked(), bench.scene(), "--json", "-"});
  const auto documents = nlohmann::json::parse(data.out);
  ASSERT_TRUE(documents.is_array());
  EXPECT_EQ(documents.at(0), nlohmann::json::parse(run_packtrace({"info", bench.baked(), "--json", "-"}).out));
  EXPECT_EQ(documents.at(1).at("input"), bench.scene());

  const CommandResult damaged = run_packtrace({"info", bench / "none.ptk", bench.baked(), "--json", bench / "x.json"});
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_TRUE(contains(damaged.err, "none.ptk")) << damaged.err;
  EXPECT_TRUE(contains(damaged.out, "small.ptk")) << "the others are told of: " << damaged.out;
  const auto rest = nlohmann::json::parse(read_text(bench / "x.json"));
  EXPECT_EQ(rest.at(0).at("error").at("kind"), "input");
  EXPECT_EQ(rest.at(1).at("triangles"), 4);
}

TEST(Habits, VerboseRenderSaysWhatWasChosenAndWhy) {
  const Workbench bench;
  bench.bake();
  const CommandResult brief = run_packtrace({"render", bench.baked(), "-o", bench / "a.png", "--frames", "1"});
  const CommandResult verbose = run_packtrace({"render", bench.baked(), "-o", bench / "b.png", "--frames", "1", "-v"});
  EXPECT_EQ(verbose.exit_code, 0) << verbose.err;
  for (const char* said : {"camera", "perspective", "ambient occlusion radius", "grid step", "backend", "threads",
                           "load", "write", "peak memory"})
    EXPECT_TRUE(contains(verbose.out, said)) << said << "\n" << verbose.out;
  EXPECT_FALSE(contains(brief.out, "grid step"));
  const CommandResult chosen = run_packtrace({"render", bench.scene(), "-o", bench / "c.png", "--frames", "1", "-v",
                                              "--camera", "auto", "--ao-radius", "0.5", "--size", "20x10"});
  for (const char* said : {"--camera auto", "--ao-radius", "--size", "floats"})
    EXPECT_TRUE(contains(chosen.out, said)) << said << "\n" << chosen.out;
}

TEST(Habits, OutputIntoAFolderThatIsNotThereIsRefusedBeforeTheWork) {
  const Workbench bench;
  const CommandResult result = run_packtrace({"bake", bench / "none.pbrt", "-o", bench / "no/such/a.ptk"});
  EXPECT_EQ(result.exit_code, 6) << "before the scene is read";
  EXPECT_TRUE(contains(result.err, "no/such")) << result.err;
}

TEST(Habits, NothingIsColouredWhereNobodyLooks) {
  for (const char* variable : {"NO_COLOR=1", "TERM=xterm", "CLICOLOR_FORCE=0"})
    EXPECT_EQ(run_packtrace({"polish"}, {variable}).err.find('\x1b'), std::string::npos);
}

} // namespace
} // namespace packtrace::test
