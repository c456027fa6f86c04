#include "compress/bake/bake_scene.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "tests/compress/test_scenes.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

class BakeOutput : public testing::Test {
protected:
  static std::string content(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }
  size_t files() const { return folder_.files(); }
  static ErrorKind kind_of(const auto& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.kind();
    }
    ADD_FAILURE() << "nothing was thrown";
    return ErrorKind::kCancelled;
  }

  const TemporaryFolder folder_;
};

TEST_F(BakeOutput, AWriteThatFailsHalfWayLeavesTheOldFileAlone) {
  write_file_bytes(folder_ / "a.ptk", bytes("old"));
  struct rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &limit), 0);
  struct rlimit small = limit;
  small.rlim_cur = 1000; // maximum file size in bytes; every baked file is larger
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const Scene scene = test::scene_of(test::grid_mesh(8));
  Diagnostics diagnostics;
  Progress progress;
  EXPECT_EQ(kind_of([&] { bake_scene(scene, {}, folder_ / "a.ptk", true, diagnostics, progress); }), ErrorKind::kIo);
  EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_EQ(content(folder_ / "a.ptk"), "old");
  EXPECT_EQ(files(), 1u);
}

TEST_F(BakeOutput, TheOutputIsCheckedBeforeTheSceneIsBaked) {
  Scene bad = test::scene_of(test::grid_mesh(2));
  bad.shapes[0].mesh = 99; // would throw Error(kInput) once work starts
  write_file_bytes(folder_ / "a.ptk", bytes("old"));
  Diagnostics diagnostics;
  Progress progress;
  EXPECT_EQ(kind_of([&] { bake_scene(bad, {}, folder_ / "a.ptk", false, diagnostics, progress); }), ErrorKind::kIo);
  EXPECT_EQ(kind_of([&] { bake_scene(bad, {}, folder_ / "b.ptk", false, diagnostics, progress); }), ErrorKind::kInput);
  EXPECT_EQ(files(), 1u);
}

TEST_F(BakeOutput, PackingAsksForMemoryFirst) {
  Diagnostics diagnostics;
  Progress progress;
  const Scene scene = test::scene_of(test::sphere_mesh(40));
  BakeConfig config;
  config.memory = MemoryBudget(1000);
  EXPECT_THROW(bake_scene(scene, config, folder_ / "a.ptk", false, diagnostics, progress), MemoryError);
  EXPECT_EQ(files(), 0u);
  EXPECT_EQ(config.memory.used(), 0u);
  config.memory = MemoryBudget(64 << 20);
  bake_scene(scene, config, folder_ / "a.ptk", false, diagnostics, progress);
  EXPECT_EQ(config.memory.used(), 0u);
}

TEST_F(BakeOutput, ABakedFileOpensFromDisk) {
  Diagnostics diagnostics;
  Progress progress;
  const Scene scene = test::scene_of(test::sphere_mesh(12));
  const BakeReport report = bake_scene(scene, {}, folder_ / "a.ptk", false, diagnostics, progress);
  const BakedFile file = BakedFile::open(folder_ / "a.ptk");
  EXPECT_EQ(file.file_bytes(), fs::file_size(folder_ / "a.ptk"));
  EXPECT_EQ(report.file.triangles, scene.meshes[0].triangles.size());
  EXPECT_EQ(kind_of([&] { BakedFile::open(folder_ / "none.ptk"); }), ErrorKind::kInput);
  EXPECT_EQ(kind_of([&] { BakedFile::open(folder_.path()); }), ErrorKind::kInput);
}

} // namespace
} // namespace packtrace
