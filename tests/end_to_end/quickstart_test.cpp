// Runs quickstart.sh with stubs of cmake and packtrace that only print how they were called.

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/end_to_end/command.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

/// A copy of the script in a folder tree where nothing has to be installed or built.
class Quickstart : public testing::Test {
protected:
  Quickstart() {
    fs::create_directories(tree() / ".ci");
    fs::create_directories(tree() / "build/release/bin");
    fs::create_directories(folder_ / "my scenes");
    fs::copy_file(PACKTRACE_SOURCE_DIR "/quickstart.sh", tree() / "quickstart.sh");
    write_text(tree() / ".ci/install_packages.sh", "echo installing\n");
    add_program(tree() / "build/release/bin/packtrace",
                "#!/bin/sh\necho \"packtrace $1 <$2>\"\n[ -e \"$2\" ] || [ \"$1\" != bake ]\n");
    add_program(folder_ / "cmake", "#!/bin/sh\n");
    write_text(folder_ / "my scenes/a.pbrt", small_scene_text());
  }
  CommandResult run(const std::vector<std::string>& arguments, const fs::path& from) const {
    const std::string path = "PATH=" + folder_.path().string() + ":" + std::getenv("PATH");
    return run_program((tree() / "quickstart.sh").string(), arguments, {path, "CDPATH=/tmp"}, from);
  }
  fs::path tree() const { return folder_.path() / "the tree"; }
  fs::path scenes() const { return folder_ / "my scenes"; }

private:
  static void add_program(const fs::path& file, const std::string& text) {
    write_text(file, text);
    fs::permissions(file, fs::perms::owner_all);
  }
  TemporaryFolder folder_;
};

TEST_F(Quickstart, TakesAScenePathFromWhereItIsCalled) {
  const CommandResult result = run({"a.pbrt"}, scenes());
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  const std::string scene = fs::canonical(scenes() / "a.pbrt").string();
  EXPECT_NE(result.out.find("packtrace bake <" + scene + ">"), std::string::npos) << result.out;
  EXPECT_TRUE(result.out.ends_with("\n  build/release/bin/packtrace view build/quickstart/scene.ptk\n")) << result.out;
  EXPECT_EQ(run({(scenes() / "a.pbrt").string()}, "/").exit_code, 0);
  EXPECT_EQ(run({"../my scenes/a.pbrt"}, tree()).exit_code, 0);
}

TEST_F(Quickstart, BakesTheTownByDefault) {
  fs::create_directories(tree() / "assets/town");
  write_text(tree() / "assets/town/town.pbrt", small_scene_text());
  EXPECT_EQ(run({}, "/").exit_code, 0);
}

TEST_F(Quickstart, RefusesWhatIsNotThereBeforeItInstallsAnything) {
  const CommandResult result = run({"b.pbrt"}, scenes());
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.err.find("b.pbrt"), std::string::npos) << result.err;
  EXPECT_EQ(result.out.find("installing"), std::string::npos) << result.out;
  EXPECT_EQ(run({"--help"}, scenes()).exit_code, 0);
  EXPECT_EQ(run({"a.pbrt", "b.pbrt"}, scenes()).exit_code, 2);
}

} // namespace
} // namespace packtrace::test
