#include "compress/bake/baked_writer.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "pbrt_import/scene/error.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

class BakedWriter : public testing::Test {
protected:
  BakedWriter()
      : folder_(fs::temp_directory_path() / ("packtrace_writer_" + std::to_string(::getpid()) + "_" +
                                             testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(folder_);
  }
  ~BakedWriter() override { fs::remove_all(folder_); }

  static std::string content(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }
  size_t files() const { return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), {})); }
  static ErrorKind kind_of(const auto& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.kind();
    }
    ADD_FAILURE() << "nothing was thrown";
    return ErrorKind::kCancelled;
  }

  fs::path folder_;
};

TEST_F(BakedWriter, WritesTheBytesAndLeavesNothingElse) {
  write_file_atomically(folder_ / "a.ptk", bytes("hello"), false);
  EXPECT_EQ(content(folder_ / "a.ptk"), "hello");
  EXPECT_EQ(files(), 1u);
}

TEST_F(BakedWriter, AnExistingFileNeedsForce) {
  write_file_atomically(folder_ / "a.ptk", bytes("old"), false);
  EXPECT_EQ(kind_of([&] { write_file_atomically(folder_ / "a.ptk", bytes("new"), false); }), ErrorKind::kIo);
  EXPECT_EQ(content(folder_ / "a.ptk"), "old");
  write_file_atomically(folder_ / "a.ptk", bytes("new"), true);
  EXPECT_EQ(content(folder_ / "a.ptk"), "new");
  EXPECT_EQ(files(), 1u);
}

TEST_F(BakedWriter, PlacesThatCannotBeWrittenAreIoErrors) {
  EXPECT_EQ(kind_of([&] { write_file_atomically(folder_ / "missing" / "a.ptk", bytes("x"), false); }), ErrorKind::kIo);
  EXPECT_EQ(kind_of([&] { write_file_atomically(folder_, bytes("x"), true); }), ErrorKind::kIo);
  EXPECT_EQ(kind_of([&] { write_file_atomically("/proc/packtrace.ptk", bytes("x"), true); }), ErrorKind::kIo);
  EXPECT_EQ(files(), 0u);
}

TEST_F(BakedWriter, AFullDeviceLeavesNoFile) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_EQ(kind_of([&] { write_file_atomically("/dev/full/a.ptk", bytes("x"), false); }), ErrorKind::kIo);
}

TEST_F(BakedWriter, TheOutputIsCheckedBeforeTheSceneIsBaked) {
  Scene bad = test::scene_of(test::grid_mesh(2));
  bad.shapes[0].mesh = 99; // would be Error(kInput) as soon as work starts
  write_file_atomically(folder_ / "a.ptk", bytes("old"), false);
  Diagnostics diagnostics;
  Progress progress;
  EXPECT_EQ(kind_of([&] { bake_scene(bad, {}, folder_ / "a.ptk", false, diagnostics, progress); }), ErrorKind::kIo);
  EXPECT_EQ(kind_of([&] { bake_scene(bad, {}, folder_ / "b.ptk", false, diagnostics, progress); }), ErrorKind::kInput);
  EXPECT_EQ(files(), 1u);
}

TEST_F(BakedWriter, ABakedFileOpensFromDisk) {
  Diagnostics diagnostics;
  Progress progress;
  const Scene scene = test::scene_of(test::sphere_mesh(12));
  const BakeReport report = bake_scene(scene, {}, folder_ / "a.ptk", false, diagnostics, progress);
  const BakedFile file = BakedFile::open(folder_ / "a.ptk");
  EXPECT_EQ(file.file_bytes(), fs::file_size(folder_ / "a.ptk"));
  EXPECT_EQ(report.file.triangles, scene.meshes[0].triangles.size());
  EXPECT_EQ(kind_of([&] { BakedFile::open(folder_ / "none.ptk"); }), ErrorKind::kInput);
  EXPECT_EQ(kind_of([&] { BakedFile::open(folder_); }), ErrorKind::kInput);
}

} // namespace
} // namespace packtrace
