#include <cstdint>

#include <sys/stat.h>

#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/hostile_case.h"

namespace packtrace {
namespace {

using namespace std::string_literals;

// Included files

HostileCase with(HostileCase test_case, const ImportOptions& options) {
  test_case.options = options;
  return test_case;
}

ImportOptions include_depth(uint32_t depth) {
  ImportOptions options;
  options.max_include_depth = depth;
  return options;
}
ImportOptions included_files(uint64_t count) {
  ImportOptions options;
  options.max_included_files = count;
  return options;
}
ImportOptions confined() {
  ImportOptions options;
  options.allow_files_outside_scene_folder = false;
  return options;
}
ImportOptions budget(uint64_t bytes) {
  ImportOptions options;
  options.max_file_bytes = bytes;
  return options;
}

std::vector<HostileCase> includes() {
  const std::string bomb = gzip(std::string(10'000'000, ' '));
  return {
      {"IncludesItself",
       world("Include \"scene.pbrt\""),
       R"(scene.pbrt:2:1: error: cannot include "scene.pbrt": the file includes itself
)",
       {1, 1, 0, 0}},
      {"IncludesInACycle",
       world("Include \"a\""),
       R"(b:2:2: error: cannot include "a": the file includes itself
  included from a:2:1
  included from scene.pbrt:2:1
a:3:1: error: unknown directive "Nonsense"
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a", "Identity\nInclude \"b\"\nNonsense"}, {"b", "\n Include \"./a\""}}},
      with({"IncludesTooDeep",
            world("Include \"a\""),
            R"(b:1:1: error: included files are nested more than 3 deep; "c" is skipped
  included from a:1:1
  included from scene.pbrt:2:1
)",
            {1, 1, 0, 0},
            {{"a", "Include \"b\""}, {"b", "Include \"c\" Identity"}, {"c", "Nonsense"}}},
           include_depth(3)),
      with({"IncludesTooMany",
            world("Include \"a\"\nInclude \"a\"\nInclude \"a\""),
            R"(scene.pbrt:3:1: error: more than 2 files are included in all; the rest is skipped (2 times, first here)
)",
            {1, 1, 0, 0},
            {{"a", "Identity"}}},
           included_files(2)),
      {"IncludeMissing",
       world("Include \"gone.pbrt\""),
       R"(scene.pbrt:2:1: error: cannot include "gone.pbrt": no such file
)",
       {1, 1, 0, 0}},
      {"IncludeAFolder",
       world("Include \"folder\""),
       R"(scene.pbrt:2:1: error: cannot include "folder": is a directory, not a file
)",
       {1, 1, 0, 0},
       {{"folder/x", ""}}},
      {"IncludeTheFolderItself",
       world("Include \".\""),
       R"(scene.pbrt:2:1: error: cannot include "": is a directory, not a file
)",
       {1, 1, 0, 0}},
      {"IncludeDevice",
       world("Include \"/dev/null\""),
       R"(scene.pbrt:2:1: error: cannot include "/dev/null": is a device, not a file
)",
       {1, 1, 0, 0}},
      {"IncludeNothing",
       world("Include \"\""),
       R"(scene.pbrt:2:1: error: empty file name; nothing is read
)",
       {1, 1, 0, 0}},
      {"IncludeWithoutQuotes",
       world("Include a.pbrt"),
       R"(scene.pbrt:2:9: error: expected a quoted name after Include, found "a.pbrt"; Include is ignored
)",
       {1, 1, 0, 0}},
      {"IncludeEndsInAString",
       world("Include \"a\""),
       R"(a:2:7: error: string without its closing quote: "sphere"; Shape is ignored
  included from scene.pbrt:2:1
)",
       {1, 1, 1, 0},
       {{"a", "\nShape \"sphere"}}},
      {"IncludeEndsInAnArray",
       world("Include \"a\""),
       R"(a:1:31: error: "[" without its "]": the values of parameter "radius" run into "Shape"; the parameter is ignored
  included from scene.pbrt:2:1
)",
       {2, 9801, 0, 0},
       {{"a", "Shape \"sphere\" \"float radius\" [ 2"}}},
      {"IncludeEndsInABlock",
       world("Include \"a\""),
       R"(a:1:1: warning: AttributeBegin without its AttributeEnd before the world ends at scene.pbrt:4:1
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a", "AttributeBegin\n Scale 2 2 2"}}},
      {"IncludeEndsTheWorld",
       world("Include \"a\""),
       R"(scene.pbrt:3:2: error: Shape belongs between WorldBegin and WorldEnd; it is ignored
scene.pbrt:4:1: error: WorldEnd belongs between WorldBegin and WorldEnd; it is ignored
)",
       {0, 0, 0, 0},
       {{"a", "WorldEnd"}}},
      {"IncludeUtf16",
       world("Include \"a\""),
       R"(scene.pbrt:2:1: error: cannot include "a": the file is UTF-16 text (it starts with the byte order mark U+FEFF in 16 bits); save it as UTF-8
)",
       {1, 1, 0, 0},
       {{"a", "\xff\xfeI\0d\0"s}}},
      {"IncludeBinary",
       world("Include \"a\""),
       R"(a:1:1: error: unknown directive "\x89PNG"
  included from scene.pbrt:2:1
a:2:1: error: byte 0x1A does not belong in a pbrt file
  included from scene.pbrt:2:1
a:3:1: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8 (21 times, first here)
  included from scene.pbrt:2:1
a:4:1: error: unknown directive "IHDR"
  included from scene.pbrt:2:1
a:4:8: error: byte 0x02 does not belong in a pbrt file (3 times, first here)
  included from scene.pbrt:2:1
a:4:12: error: byte 0x01 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:13: error: byte 0x08 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:25: error: byte 0x0F does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:42: error: byte 0x07 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:46: error: byte 0x05 does not belong in a pbrt file
  included from scene.pbrt:2:1
a:4:48: error: byte 0x1D does not belong in a pbrt file
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a", good_png()}}},
      {"IncludeEmpty", world("Include \"a\""), "", {1, 1, 0, 0}, {{"a", ""}}},
      {"IncludeGzipped", world("Include \"a.gz\""), "", {2, 2, 0, 0}, {{"a.gz", gzip(kTriangle)}}},
      {"IncludeGzipTruncated",
       world("Include \"a.gz\""),
       R"(a.gz: error: truncated gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
)",
       {2, 101, 0, 0},
       {{"a.gz", without_end(gzip("Shape \"disk\" Nonsense"), 9)}}},
      {"IncludeGzipTruncatedInAnArray",
       world("Include \"a.gz\""),
       R"(a.gz: error: truncated gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
a.gz:2:31: error: "[" without its "]": the values of parameter "radius" run into "Shape"; the parameter is ignored
  included from scene.pbrt:2:1
)",
       {3, 9802, 0, 0},
       {{"a.gz",
         without_end(gzip(std::string(kTriangle) + "\nShape \"sphere\" \"float radius\" [ 2 ] Nonsense"), 15)}}},
      {"IncludeGzipDamaged",
       world("Include \"a.gz\""),
       R"(a.gz: error: damaged gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
a.gz:1:1: error: unknown directive "So9pe"
  included from scene.pbrt:2:1
)",
       {1, 1, 0, 0},
       {{"a.gz", flipped(gzip("Shape \"disk\""), 12)}}},
      {"IncludeGzipOfTwoBytes",
       world("Include \"a.gz\""),
       R"(scene.pbrt:2:1: error: cannot include "a.gz": truncated gzip data
)",
       {1, 1, 0, 0},
       {{"a.gz", "\x1f\x8b"}}},
      {"IncludeGzipWithNoiseBehind",
       world("Include \"a.gz\""),
       R"(a.gz: error: damaged gzip data; the rest of the file is skipped
  included from scene.pbrt:2:1
)",
       {2, 101, 0, 0},
       {{"a.gz", gzip("Shape \"disk\"") + "noise"}}},
      {"PlyGzipTruncated",
       world(ply_shape("a.ply")),
       R"(scene.pbrt:2:1: error: plymesh "a.ply": truncated gzip data; the shape is skipped
)",
       {1, 1, 1, 0},
       {{"a.ply", without_end(gzip(kPly), 1)}}},
      {"PlyGzipChecksumWrong",
       world(ply_shape("a.ply")),
       R"(scene.pbrt:2:1: error: plymesh "a.ply": damaged gzip data; the shape is skipped
)",
       {1, 1, 1, 0},
       {{"a.ply", flipped(gzip(kPly), gzip(kPly).size() - 8)}}},
      {"SpectrumFileGzipTruncated",
       world("Material \"matte\" \"spectrum Kd\" \"a.spd\""),
       R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": truncated gzip data
)",
       {1, 1, 0, 0},
       {{"a.spd", without_end(gzip("400 0.5\n700 0.5\n"), 1)}}},
      with({"IncludeGzipBomb",
            world("Include \"a.gz\""),
            R"(a.gz: error: content exceeds the limit of 1000000 bytes for this file; the rest of the file is skipped
  included from scene.pbrt:2:1
)",
            {1, 1, 0, 0},
            {{"a.gz", bomb}}},
           budget(1'000'000)),
      {"MainFileGzipped",
       gzip(world("Nonsense")),
       R"(scene.pbrt:2:1: error: unknown directive "Nonsense"
)",
       {1, 1, 0, 0}},
      {"MainFileGzipTruncated",
       without_end(gzip(world("Shape \"disk\"")), 12),
       R"(scene.pbrt: error: truncated gzip data; the rest of the file is skipped
scene.pbrt:3:79: warning: the file ends without WorldEnd
)",
       {2, 101, 0, 0}},
      {"MainFileGzipOfTwoBytes", "\x1f\x8b", R"(scene.pbrt: truncated gzip data)", {}, {}, {}, ErrorKind::kInput},
      {"MainFileGzipChecksumWrong",
       flipped(gzip(world("Shape \"disk\"")), gzip(world("Shape \"disk\"")).size() - 8),
       R"(scene.pbrt: error: damaged gzip data; the rest of the file is skipped
)",
       {2, 101, 0, 0}},
      with(
          {"MainFileGzipBomb",
           bomb,
           R"(scene.pbrt: error: content exceeds the limit of 1000000 bytes for this file; the rest of the file is skipped
scene.pbrt: warning: the file ends without WorldBegin: the scene is empty
)",
           {0, 0, 0, 0}},
          budget(1'000'000)),
      with(
          {"MainFileTooLarge",
           world("#" + std::string(2'000'000, ' ')),
           R"(scene.pbrt: error: content exceeds the limit of 1000000 bytes for this file; the rest of the file is skipped
scene.pbrt:1:1: warning: the file ends without WorldEnd
)",
           {0, 0, 0, 0}},
          budget(1'000'000)),
  };
}

// File names and spectrum files

HostileCase ply_case(const std::string& name, const std::string& file, const std::string& diagnostics) {
  return {name, world(ply_shape(file)), diagnostics, {1, 1, 1, 0}};
}
HostileCase spd_case(const std::string& name, const std::string& content, const std::string& diagnostics) {
  return {name, world("Material \"matte\" \"spectrum Kd\" \"a.spd\""), diagnostics, {1, 1, 0, 0}, {{"a.spd", content}}};
}

std::vector<HostileCase> file_names() {
  return {
      ply_case("PlyMissing", "gone.ply",
               R"(scene.pbrt:2:1: error: plymesh "gone.ply": no such file; the shape is skipped
)"),
      ply_case("PlyMissingInAMissingFolder", "no/such/folder/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "no/such/folder/a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameLeadsOutOfTheFilesystem", "../../../../../../../../../../../../gone.ply",
               R"(scene.pbrt:2:1: error: plymesh "/gone.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameAbsolute", "/nonexistent/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "/nonexistent/a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameOfADevice", "/dev/zero",
               R"(scene.pbrt:2:1: error: plymesh "/dev/zero": is a device, not a file; the shape is skipped
)"),
      ply_case("PlyNameOfWindows", "C:\\\\models\\\\a.ply",
               R"(scene.pbrt:2:1: error: plymesh "C:\models\a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameWithoutDoubledBackslashes", "models\\a.ply",
               R"(scene.pbrt:2:1: error: plymesh "models/a.ply": no such file; the shape is skipped
scene.pbrt:2:17: warning: file names have back-slashes, "models\a.ply"; read as slashes
)"),
      ply_case("PlyNameOfAFolder", ".",
               R"(scene.pbrt:2:1: error: plymesh "": is a directory, not a file; the shape is skipped
)"),
      ply_case("PlyNameWithAFileAsFolder", "scene.pbrt/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "scene.pbrt/a.ply": cannot open: Not a directory; the shape is skipped
)"),
      ply_case("PlyNameWithSpaces", " a.ply ",
               R"(scene.pbrt:2:1: error: plymesh " a.ply ": no such file; the shape is skipped
)"),
      ply_case("PlyNameEmpty", "", R"(scene.pbrt:2:17: error: empty file name; nothing is read
)"),
      ply_case("PlyNameLooksLikeAnAddress", "http://example.org/a.ply",
               R"(scene.pbrt:2:1: error: plymesh "http:/example.org/a.ply": no such file; the shape is skipped
)"),
      ply_case("PlyNameWithAPercentSign", "%s%n.ply",
               R"(scene.pbrt:2:1: error: plymesh "%s%n.ply": no such file; the shape is skipped
)"),
      with(ply_case("PlyNameOutsideConfined", "../a.ply",
                    R"(scene.pbrt:2:17: error: file name "../a.ply" leads out of the scene's folder; it is not read
)"),
           confined()),
      with(ply_case("PlyNameAbsoluteConfined", "/dev/null",
                    R"(scene.pbrt:2:17: error: file name "/dev/null" leads out of the scene's folder; it is not read
)"),
           confined()),
      with(ply_case("PlyNameBackslashesConfined", "..\\\\a.ply",
                    R"(scene.pbrt:2:1: error: plymesh "..\a.ply": no such file; the shape is skipped
)"),
           confined()),
      {"PlyWithoutName",
       world("Shape \"plymesh\""),
       R"(scene.pbrt:2:1: error: plymesh without a "string filename"; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyWithTwoNames",
       world("Shape \"plymesh\" \"string filename\" [ \"a.ply\" \"b.ply\" ]"),
       R"(scene.pbrt:2:1: error: plymesh takes one file name, found 2; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyNameMisspelled",
       world("Shape \"plymesh\" \"string file\" \"a.ply\""),
       R"(scene.pbrt:2:1: error: plymesh without a "string filename"; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyMissingThreeTimes",
       world(ply_shape("gone.ply") + ply_shape("./gone.ply") + ply_shape("x/../gone.ply")),
       R"(scene.pbrt:2:1: error: plymesh "gone.ply": no such file; the shape is skipped (3 times, first here)
)",
       {1, 1, 3, 0}},
      {"PlyMissingInAnObject",
       world("ObjectBegin \"o\" " + ply_shape("gone.ply") + "ObjectEnd\nObjectInstance \"o\"\nObjectInstance \"o\""),
       R"(scene.pbrt:2:17: error: plymesh "gone.ply": no such file; the shape is skipped
)",
       {1, 1, 1, 0}},
      {"PlyMissingInAnInclude",
       world("Include \"a\""),
       R"(a:2:3: error: plymesh "gone.ply": no such file; the shape is skipped
  included from scene.pbrt:2:1
)",
       {1, 1, 1, 0},
       {{"a", "\n  " + ply_shape("gone.ply")}}},
      spd_case("SpectrumFileEmpty", "",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileOfText", "400 red\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileOddCount", "400 1 500\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileNotANumber", "400 nan 500 1\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": its values are not finite
)"),
      spd_case("SpectrumFileWithCommas", "400, 1\n500, 1\n",
               R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": not a list of wavelength and value pairs
)"),
      spd_case("SpectrumFileGzipped", gzip("400 0.5\n700 0.5\n"), ""),
      spd_case(
          "SpectrumFileTooLarge", gzip(std::string(17 << 20, ' ')),
          R"(scene.pbrt:2:18: error: cannot read spectrum file "a.spd": content exceeds the limit of 16777216 bytes for this file
)"),
      {"SpectrumFileMissing",
       world("Material \"matte\" \"spectrum Kd\" \"gone.spd\""),
       R"(scene.pbrt:2:18: error: cannot read spectrum file "gone.spd": no such file
)",
       {1, 1, 0, 0}},
      {"SpectrumFileOfAKnownMetalMissing",
       world("Material \"metal\" \"spectrum eta\" \"Au.eta.spd\""),
       "",
       {1, 1, 0, 0}},
      {"SpectrumFileOfAKnownMetalDamaged",
       world("Material \"metal\" \"spectrum eta\" \"Au.eta.spd\""),
       R"(scene.pbrt:2:18: error: cannot read spectrum file "Au.eta.spd": not a list of wavelength and value pairs
)",
       {1, 1, 0, 0},
       {{"Au.eta.spd", "gold"}}},
  };
}

const bool kRegistered = register_cases("HostileIncludes", includes(), __FILE__) &&
                         register_cases("HostileFileNames", file_names(), __FILE__);

// Cases that need more than the table: paths that are not regular files.

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
