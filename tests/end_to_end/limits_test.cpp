// Behaviour at the end of input, memory or disk space.

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/end_to_end/workbench.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

/// Ends a hanging process with SIGALRM, which run_program() reports as 128 + SIGALRM.
void end_soon() { ::alarm(60); }

TEST(Limits, PipesAndDevicesAreRefusedAtOnce) {
  const Workbench bench;
  bench.bake();
  for (const char* name : {"pipe.pbrt", "pipe.ptk", "pipe.png"}) ASSERT_EQ(::mkfifo((bench / name).c_str(), 0600), 0);
  const std::string out = bench / "out.png";
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"info", bench / "pipe.pbrt"},
                                                    {"info", bench / "pipe.ptk"},
                                                    {"info", "/dev/zero"},
                                                    {"info", bench.path().string()},
                                                    {"bake", bench / "pipe.pbrt", "-o", bench / "out.ptk"},
                                                    {"bake", "/dev/zero", "-o", bench / "out.ptk"},
                                                    {"render", bench / "pipe.pbrt", "-o", out},
                                                    {"render", bench / "pipe.ptk", "-o", out},
                                                    {"export", bench / "pipe.ptk", "-o", bench / "out.glb"},
                                                    {"compare", bench / "pipe.png", bench / "pipe.png"}}) {
    const CommandResult result = run_packtrace(arguments, end_soon);
    EXPECT_EQ(result.exit_code, 3) << arguments[0] << ' ' << arguments[1] << '\n' << result.err;
    EXPECT_NE(result.err.find(arguments[1] + ": is a "), std::string::npos) << result.err;
  }
  EXPECT_EQ(file_count(bench.path()), 5u);
}

TEST(Limits, FilesLargerThanTheLimitOfTheProcessAreAnIoErrorAndLeaveNothing) {
  const Workbench bench;
  write_text(bench / "ball.pbrt", "WorldBegin\nShape \"sphere\"\nWorldEnd\n");
  const std::string out = bench / "out.ptk";
  const auto small_files = [] {
    const struct rlimit limit{4096, 4096};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  };
  const CommandResult result = run_packtrace({"bake", bench / "ball.pbrt", "-o", out}, small_files);
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_NE(result.err.find(out + ": cannot write: larger than files may be here"), std::string::npos) << result.err;
  EXPECT_EQ(file_count(bench.path()), 2u);
}

TEST(Limits, InputBeyondTheMemoryBudgetIsAnInputErrorWithItsPlace) {
  const Workbench bench;
  const std::string scene = bench / "fine.pbrt", out = bench / "out.ptk";
  write_text(scene, "WorldBegin\nShape \"loopsubdiv\" \"integer nlevels\" 8 \"integer indices\" [0 1 2]\n"
                    "  \"point P\" [0 0 0 1 0 0 0 1 0]\nWorldEnd\n");
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"info", scene},
                                                    {"bake", scene, "-o", out},
                                                    {"render", scene, "-o", bench / "a.png"}}) {
    std::vector<std::string> limited = arguments;
    limited.insert(limited.end(), {"--max-memory", "1M"});
    const CommandResult result = run_packtrace(limited);
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_NE(result.err.find(scene + ":2:1: the shape needs "), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("; --max-memory raises it"), std::string::npos) << result.err;
  }
  EXPECT_EQ(run_packtrace({"info", scene, "--max-memory", "64M"}).exit_code, 0);
  const CommandResult packing = run_packtrace({"bake", scene, "-o", out, "--max-memory", "12M"});
  EXPECT_EQ(packing.exit_code, 3);
  EXPECT_NE(packing.err.find("packing 65536 triangles needs "), std::string::npos) << packing.err;
  EXPECT_EQ(file_count(bench.path()), 2u);
  for (const char* size : {"much", "0", "-5", ""})
    EXPECT_EQ(run_packtrace({"info", scene, std::string("--max-memory=") + size}).exit_code, 2) << size;
}

TEST(Limits, PicturesAndBakedFilesAskForMemoryToo) {
  const Workbench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "-q", "--codec", "small"}).exit_code, 0);
  const std::string out = bench / "out.png";
  const CommandResult picture =
      run_packtrace({"render", bench.baked(), "-o", out, "--size", "16000x16000", "--max-memory", "1G"}, end_soon);
  EXPECT_EQ(picture.exit_code, 3);
  EXPECT_NE(picture.err.find("a picture of 16000 x 16000 pixels needs "), std::string::npos) << picture.err;
  const CommandResult decoded = run_packtrace({"info", bench.baked(), "--max-memory", "100"});
  EXPECT_EQ(decoded.exit_code, 3);
  EXPECT_NE(decoded.err.find(bench.baked() + ": decoding the file needs "), std::string::npos) << decoded.err;
}

TEST(Limits, EmbreeAsksForMemoryToo) {
  const Workbench bench;
  const std::string scene = bench / "fine.pbrt", out = bench / "out.png";
  write_text(scene, "WorldBegin\nShape \"loopsubdiv\" \"integer nlevels\" 8 \"integer indices\" [0 1 2]\n"
                    "  \"point P\" [0 0 0 1 0 0 0 1 0]\nWorldEnd\n");
  ASSERT_EQ(run_packtrace({"bake", scene, "-o", bench.baked(), "-q"}).exit_code, 0);
  const auto render = [&](const char* backend, const char* memory) {
    return run_packtrace({"render", bench.baked(), "-o", out, "-q", "--force", "--size", "8x8", "--backend", backend,
                          "--max-memory", memory});
  };
  const CommandResult decoding = render("embree", "1M");
  EXPECT_EQ(decoding.exit_code, 3);
  EXPECT_NE(decoding.err.find(bench.baked() + ": decoding the scene for Embree needs "), std::string::npos)
      << decoding.err;
  const CommandResult building = render("embree", "4M");
  EXPECT_EQ(building.exit_code, 3);
  EXPECT_NE(building.err.find(bench.baked() + ": Embree's trees need more than the "), std::string::npos)
      << building.err;
  for (const char* backend : {"embree", "packed"}) EXPECT_EQ(render(backend, "64M").exit_code, 0) << backend;
}

TEST(Limits, ComparedImagesAskForMemoryToo) {
  const Workbench bench;
  bench.bake();
  const std::string png = bench / "a.png", exr = bench / "a.exr";
  ASSERT_EQ(
      run_packtrace({"render", bench.baked(), "-o", png, "-o", exr, "-q", "--spp", "1", "--size", "256x256"}).exit_code,
      0);
  for (const std::string& image : {png, exr}) {
    ASSERT_TRUE(fs::exists(image)) << image;
    if (!sanitized()) { // slow
      EXPECT_EQ(run_packtrace({"compare", image, image, "--max-memory", "16M"}).exit_code, 0);
    }
    const CommandResult large = run_packtrace({"compare", image, image, "--max-memory", "512K"});
    EXPECT_EQ(large.exit_code, 3);
    EXPECT_NE(large.err.find(image + ": the image needs "), std::string::npos) << large.err;
    const CommandResult larger = run_packtrace({"compare", image, image, "--max-memory", "5M"});
    EXPECT_EQ(larger.exit_code, 3);
    EXPECT_NE(larger.err.find("comparing the images needs "), std::string::npos) << larger.err;
  }
}

TEST(Limits, APrivateCopyIsRenderedLikeTheFile) {
  const Workbench bench;
  bench.bake();
  const std::string a = bench / "a.exr", b = bench / "b.exr";
  ASSERT_EQ(run_packtrace({"render", bench.baked(), "-o", a, "-q", "--frames", "2"}).exit_code, 0);
  ASSERT_EQ(run_packtrace({"render", bench.baked(), "-o", b, "-q", "--frames", "2", "--private-copy"}).exit_code, 0);
  EXPECT_EQ(read_text(a), read_text(b));
}

} // namespace
} // namespace packtrace::test
