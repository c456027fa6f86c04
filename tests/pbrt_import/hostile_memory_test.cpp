// Small inputs that require much memory.

#include <string>

#include <gtest/gtest.h>

#include "pbrt_import/base/memory_budget.h"
#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/hostile_scene.h"

namespace packtrace {
namespace {

constexpr uint64_t kBudget = 8u << 20;

/// Message of the MemoryError that importing text throws, or "accepted".
std::string refusal(const SceneFolder& folder, const std::string& text) {
  ImportOptions options;
  options.memory = MemoryBudget(kBudget);
  options.keep_textures = true;
  const std::filesystem::path scene = folder.write("scene.pbrt", text);
  try {
    (void)import_file(scene, options);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(options.memory.used(), 0u);
    return without_folder(error.what(), folder);
  }
  EXPECT_EQ(options.memory.used(), 0u);
  return "accepted";
}

void expect_refused(const std::string& refused, const std::string& place, const std::string& what) {
  EXPECT_EQ(refused.find(place + ": " + what + " needs "), 0u) << refused;
  EXPECT_NE(refused.find("iB of memory, of "), std::string::npos) << refused;
  EXPECT_NE(refused.find(" left; --max-memory raises it"), std::string::npos) << refused;
}

TEST(HostileMemory, SubdivisionAsksForItsFinestLevel) {
  const SceneFolder folder;
  const auto text = [](int levels) {
    return world("Shape \"loopsubdiv\" \"integer nlevels\" [" + std::to_string(levels) +
                 "] \"integer indices\" [0 1 2 0 2 3] \"point P\" [0 0 0 1 0 0 1 1 0 0 1 0]");
  };
  EXPECT_EQ(refusal(folder, text(6)), "accepted");
  expect_refused(refusal(folder, text(12)), "scene.pbrt:2:1", "the shape");
}

TEST(HostileMemory, CurvesAskForTheirPieces) {
  const SceneFolder folder;
  std::string points;
  for (int i = 0; i < 100; ++i) points += "0 0 0 1 9 0 2 -9 0 ";
  expect_refused(refusal(folder, world("Shape \"curve\" \"point P\" [" + points + "3 0 0] \"float width\" [1e-9]")),
                 "scene.pbrt:2:1", "the shape");
}

TEST(HostileMemory, NurbsAskForTheirGrid) {
  const SceneFolder folder;
  std::string knots = "0 0 0", points;
  for (int i = 0; i < 60; ++i) knots += " " + std::to_string(i + 1);
  knots += " 60 60";
  for (int v = 0; v < 62; ++v)
    for (int u = 0; u < 62; ++u)
      points += std::to_string(u) + " " + std::to_string(v) + " " + std::to_string(50 * ((u + v) % 2)) + " ";
  expect_refused(refusal(folder, world("Shape \"nurbs\" \"integer nu\" 62 \"integer nv\" 62 \"integer uorder\" 3 "
                                       "\"integer vorder\" 3 \"float uknots\" [" +
                                       knots + "] \"float vknots\" [" + knots + "] \"point P\" [" + points + "]")),
                 "scene.pbrt:2:1", "the shape");
}

TEST(HostileMemory, ManySmallShapesAddUp) {
  const SceneFolder folder;
  std::string shapes;
  for (int i = 0; i < 500; ++i) shapes += "Shape \"cylinder\" \"float zmax\" " + std::to_string(i + 2) + "\n";
  EXPECT_EQ(refusal(folder, world(shapes)), "accepted");
  shapes.clear();
  for (int i = 0; i < 500; ++i) shapes += "Shape \"sphere\" \"float zmax\" 0." + std::to_string(1000 + i) + "\n";
  const std::string refused = refusal(folder, world(shapes));
  EXPECT_NE(refused.find(":1: the shape needs "), std::string::npos) << refused;
  std::string instances = "ObjectBegin \"o\"\n" + std::string(kTriangle) + "\nObjectEnd\n";
  for (int i = 0; i < 40'000; ++i) instances += "ObjectInstance \"o\"\n";
  const std::string many = refusal(folder, world(instances));
  EXPECT_NE(many.find(":1: what the scene's text describes needs "), std::string::npos) << many;
}

TEST(HostileMemory, ListsAskBeforeTheyGrow) {
  const SceneFolder folder;
  std::string strings, numbers;
  for (int i = 0; i < 200'000; ++i) strings += "\"\"";
  for (int i = 0; i < 3'000'000; ++i) numbers += "0 ";
  const std::string what = "what the directive's parameters hold";
  for (const std::string& list : {"Material \"matte\" \"string x\" [" + strings,
                                  "Material \"matte\" \"float x\" [" + numbers, "Transform [" + numbers}) {
    const std::string refused = refusal(folder, world(list + "]"));
    EXPECT_EQ(refused.find("scene.pbrt:2:"), 0u) << refused;
    EXPECT_NE(refused.find(what + " needs "), std::string::npos) << refused;
  }
  std::string parameters;
  for (int i = 0; i < 100'000; ++i) parameters += "\"float a\" 1\n";
  const std::string refused = refusal(folder, world("Material \"matte\"\n" + parameters));
  EXPECT_TRUE(refused == "accepted" || refused.find(what) != std::string::npos) << refused;
}

TEST(HostileMemory, StringsLongerThanAnyNameAreLeftOut) {
  const SceneFolder folder;
  const std::string text(50'000'000, 'a');
  EXPECT_EQ(refusal(folder, world("Material \"matte\" \"string x\" \"" + text + "\"")), "accepted");
  EXPECT_EQ(refusal(folder, world("Material \"" + text + "\"")), "accepted");
  EXPECT_EQ(refusal(folder, world(text)), "accepted");
  const Imported imported = import_text(folder, world("Material \"" + text + "\""));
  EXPECT_EQ(
      without_folder(imported.text(), folder),
      "scene.pbrt:2:10: error: expected a quoted name after Material, found a word or string of more than 2.0 MiB; "
      "Material is ignored\n");
  EXPECT_EQ(kept_of(imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileMemory, CompressedMeshesAskForWhatTheyInflateTo) {
  const SceneFolder folder;
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex 1000000\nproperty float x\nproperty float y\n"
                    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  ply += std::string(12'000'000, '\0') + std::string("\3\0\0\0\0\1\0\0\0\2\0\0\0", 13);
  folder.write("a.ply", gzip(ply));
  expect_refused(refusal(folder, world(ply_shape("a.ply"))), "scene.pbrt:2:1: \"a.ply\"", "its content");
}

TEST(HostileMemory, PolygonsAskForTheirTriangles) {
  const SceneFolder folder;
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                    "property float z\nelement face 1\nproperty list uint uchar vertex_indices\nend_header\n";
  ply += std::string(36, '\0') + std::string("\x80\x84\x1e\0", 4) + std::string(2'000'000, '\1');
  folder.write("a.ply", ply);
  expect_refused(refusal(folder, world(ply_shape("a.ply"))), "scene.pbrt:2:1: \"a.ply\"", "its mesh");
}

TEST(HostileMemory, ImagesAskForTheirPixels) {
  const SceneFolder folder;
  // Run-length encoded; 4096 x 4096 pixels of 3 bytes.
  std::string tga{0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 16, 0, 16, 24, 0};
  for (int i = 0; i < 4096 * 4096 / 128; ++i) tga += std::string("\xff\1\2\3", 4);
  folder.write("a.tga", tga);
  const std::string text = world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.tga\"\n"
                                 "Material \"matte\" \"texture Kd\" \"t\"");
  expect_refused(refusal(folder, text), "scene.pbrt:2:1: \"a.tga\"", "decoding its 4096 x 4096 pixels");
}

} // namespace
} // namespace packtrace
