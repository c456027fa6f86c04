// Paths that are not regular files, and names that are too long.

#include <sys/stat.h>

#include "tests/pbrt_import/hostile_scene.h"

namespace packtrace {
namespace {

ImportOptions confined() {
  ImportOptions options;
  options.allow_files_outside_scene_folder = false;
  return options;
}

std::string listed_folders(int count) {
  std::string path;
  for (int i = 0; i < count; ++i) path += "a/";
  return path;
}

void make_fifo(const SceneFolder& folder, const char* name) {
  ASSERT_EQ(::mkfifo((folder.path() / name).c_str(), 0600), 0);
}

TEST(HostileFiles, FifosAreNotWaitedFor) {
  const SceneFolder folder;
  make_fifo(folder, "fifo");
  const Imported imported =
      import_text(folder, world("Include \"fifo\"\n" + ply_shape("fifo") +
                                "Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"fifo\"\n"
                                "Material \"matte\" \"spectrum Kd\" \"fifo\""));
  EXPECT_EQ(
      without_folder(imported.text(), folder),
      "scene.pbrt:2:1: error: cannot include \"fifo\": is a pipe, not a file; save what it delivers in a file first\n"
      "scene.pbrt:3:1: error: plymesh \"fifo\": is a pipe, not a file; save what it delivers in a file first; the "
      "shape is skipped\n"
      "scene.pbrt:4:32: error: texture file \"fifo\" is not a regular file; it counts as white\n"
      "scene.pbrt:5:18: error: cannot read spectrum file \"fifo\": is a pipe, not a file; save what it delivers in "
      "a file first\n");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
}

TEST(HostileFiles, LinksThatLeadOutOfTheFolderAreNotFollowedWhenConfined) {
  const SceneFolder folder;
  folder.write("secret.ply", kPly);
  const auto scene = folder.write("scene/scene.pbrt", world(ply_shape("link.ply")));
  std::filesystem::create_symlink("../secret.ply", folder.path() / "scene/link.ply");
  EXPECT_EQ(import_file(scene).scene.shapes.size(), 2u);
  const Imported imported = import_file(scene, confined());
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene/scene.pbrt:2:17: error: file name \"link.ply\" leads out of the scene's folder; it is not read\n");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
}

TEST(HostileFiles, LinksInACircleEnd) {
  const SceneFolder folder;
  std::filesystem::create_symlink("b.ply", folder.path() / "a.ply");
  std::filesystem::create_symlink("a.ply", folder.path() / "b.ply");
  const Imported imported = import_text(folder, world(ply_shape("a.ply")));
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene.pbrt:2:1: error: plymesh \"a.ply\": cannot open: Too many levels of symbolic links; the shape is "
            "skipped\n");
}

TEST(HostileFiles, LongNamesAreCutInMessages) {
  const SceneFolder folder;
  for (const std::string& name : {std::string(5000, 'a'), listed_folders(3000) + "a.ply"}) {
    const Imported imported = import_text(folder, world(ply_shape(name)));
    ASSERT_EQ(imported.diagnostics.size(), 1u);
    const std::string& message = imported.diagnostics[0].message;
    EXPECT_TRUE(message.starts_with("plymesh \"" + folder.path().string() + "/a"));
    EXPECT_TRUE(message.ends_with("...\": cannot open: File name too long; the shape is skipped"));
    EXPECT_LT(message.size(), 4200u);
    EXPECT_EQ(kept_of(imported), (Kept{1, 1, 1, 0}));
  }
}

/// Message of the Error that importing main_file throws.
std::string refusal_of(const std::filesystem::path& main_file) {
  try {
    (void)import_file(main_file);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return "accepted";
}

TEST(HostileFiles, MainFileMustBeAFile) {
  const SceneFolder folder;
  make_fifo(folder, "fifo");
  EXPECT_EQ(without_folder(refusal_of(folder.path() / "fifo"), folder),
            "fifo: is a pipe, not a file; save what it delivers in a file first");
  EXPECT_EQ(without_folder(refusal_of(folder.path() / ""), folder), ": is a directory, not a file");
  EXPECT_EQ(refusal_of("/dev/zero"), "/dev/zero: is a device, not a file");
  EXPECT_EQ(refusal_of(""), ": no such file");
  EXPECT_EQ(without_folder(refusal_of(folder.path() / std::string(300, 'x')), folder),
            std::string(300, 'x') + ": cannot open: File name too long");
}

} // namespace
} // namespace packtrace
