#include "pbrt_import/ply_sequence.h"

#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/frame_pattern.h"
#include "pbrt_import/import_scene.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

TEST(FramePattern, NumbersFilesAndFindsTheirNumbers) {
  const FramePattern padded("dir/grass_%04d.ply"), plain("f%d.ply"), percent("100%%_%02d.ply");
  EXPECT_EQ(padded.file(7), fs::path("dir/grass_0007.ply"));
  EXPECT_EQ(padded.file(12345), fs::path("dir/grass_12345.ply"));
  EXPECT_EQ(plain.file(12), fs::path("f12.ply"));
  EXPECT_EQ(percent.file(3), fs::path("100%_03.ply"));
  EXPECT_EQ(padded.number_of("grass_0007.ply"), 7);
  EXPECT_EQ(padded.number_of("grass_12345.ply"), 12345);
  for (const char* other : {"grass_7.ply", "grass_00007.ply", "grass_.ply", "grass_000x.ply", "grass_0007.pl",
                            "grass_9999999999999999999.ply"})
    EXPECT_FALSE(padded.number_of(other)) << other;
  EXPECT_FALSE(plain.number_of("f07.ply"));
  EXPECT_EQ(plain.below("scene").file(1), fs::path("scene/f1.ply"));
}

TEST(FramePattern, RejectsPatternsWithoutExactlyOneNumber) {
  for (const char* bad : {"grass.ply", "grass_%d_%d.ply", "%x.ply", "%4d.ply", "%0d.ply", "%019d.ply", "%00d.ply", "%",
                          "a%", "f%d/grass_%d.ply", "f%d/grass.ply", "", "100%%.ply", "%99999999999999999999d.ply"})
    try {
      const FramePattern pattern{std::string(bad)};
      ADD_FAILURE() << bad;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    }
}

/// A scene whose mesh is the first of some frames.
class PlySequence : public testing::Test {
protected:
  void write_frame(const std::string& name, const std::string& vertices = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n",
                   const std::string& faces = "3 0 1 2\n3 0 2 3\n", int vertex_count = 4, int face_count = 2) const {
    std::ofstream out(folder_ / name);
    out << "ply\nformat ascii 1.0\nelement vertex " << vertex_count
        << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << face_count
        << "\nproperty list uchar int vertex_indices\nend_header\n"
        << vertices << faces;
  }
  ImportResult import(const std::string& mesh) const {
    std::ofstream(folder_ / "scene.pbrt")
        << "WorldBegin\nShape \"plymesh\" \"string filename\" \"" << mesh << "\"\nShape \"sphere\"\nWorldEnd\n";
    Diagnostics diagnostics;
    Progress progress;
    return import_scene(folder_ / "scene.pbrt", {}, diagnostics, progress);
  }
  MeshSequence find(const ImportResult& imported, const std::string& pattern,
                    std::optional<int64_t> start = std::nullopt) const {
    return find_mesh_sequence(imported.scene, imported.files, folder_ / "scene.pbrt", pattern, start, 24.0);
  }
  /// Finds the sequence of f_%02d.ply and reads all frames; they must fail.
  void expect_failure(const std::string& part, const std::string& pattern = "f_%02d.ply",
                      std::optional<int64_t> start = std::nullopt, ErrorKind kind = ErrorKind::kInput) const {
    try {
      const MeshSequence sequence = find(import("f_03.ply"), pattern, start);
      for (uint32_t i = 0; i < sequence.frames->count(); ++i) (void)sequence.frames->positions(i);
      ADD_FAILURE() << part;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind);
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

  TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(PlySequence, BeginsWithTheScenesFileAndEndsBeforeTheFirstMissingOne) {
  for (const char* name : {"f_03.ply", "f_04.ply", "f_05.ply"}) write_frame(name);
  write_frame("f_04.ply", "0 0 1\n1 0 1\n1 1 1\n0 1 1\n");
  const ImportResult imported = import("f_03.ply");
  const MeshSequence sequence = find(imported, "f_%02d.ply");
  EXPECT_EQ(imported.scene.meshes[sequence.mesh].name, "f_03.ply");
  EXPECT_EQ(sequence.first_number, 3);
  ASSERT_EQ(sequence.frames->count(), 3u);
  EXPECT_EQ(sequence.frames->positions(1)[2], Vec3(1, 1, 1));
  EXPECT_EQ(find(imported, file("f_%02d.ply"), 3).frames->count(), 3u);
}

TEST_F(PlySequence, NamesTheFrameWithAnotherTopology) {
  write_frame("f_03.ply"), write_frame("f_04.ply");
  write_frame("f_05.ply", "0 0 0\n1 0 0\n1 1 0\n0 1 0\n", "3 0 1 2\n3 0 3 2\n");
  expect_failure("frame 5 (" + file("f_05.ply") + "): triangle 1 has the vertices 0 3 2, but 0 2 3 in frame 3");
  write_frame("f_05.ply", "0 0 0\n1 0 0\n1 1 0\n", "3 0 1 2\n", 3, 1);
  expect_failure("frame 5 (" + file("f_05.ply") + "): 3 vertices in triangles, but frame 3");
  write_frame("f_05.ply", "0 0 0\n1 0 0\n1 1 0\n0 1 0\n", "3 0 1 2\n3 0 2 3\n3 1 2 3\n", 4, 3);
  expect_failure("3 triangles, but frame 3");
}

TEST_F(PlySequence, NamesTheFrameThatIsMissingOrDamaged) {
  write_frame("f_03.ply"), write_frame("f_04.ply"), write_frame("f_06.ply");
  expect_failure("frame 5 (" + file("f_05.ply") + "): the file is missing, but that of frame 6 exists");
  write_frame("f_05.ply", "0 0 0\n1 0 0\n1 nan 0\n0 1 0\n");
  expect_failure("frame 5 (" + file("f_05.ply") + "): 2 triangles");
  expect_failure("position not finite");
  std::ofstream(folder_ / "f_05.ply") << "ply\n";
  expect_failure("frame 5 (" + file("f_05.ply") + ")");
}

TEST_F(PlySequence, RejectsWhatTheSceneDoesNotUse) {
  write_frame("f_03.ply"), write_frame("f_04.ply");
  expect_failure("did you mean f_03.ply?", "g_%02d.ply");
  expect_failure("did you mean f_03.ply?", "f_%02d.ply", 4);
  expect_failure("10^18", "f_%02d.ply", -1, ErrorKind::kUsage);
  fs::remove(folder_ / "f_04.ply");
  expect_failure("one frame only");
}

} // namespace
} // namespace packtrace
