// Imports of OBJ, STL and PLY files.

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "pbrt_import/base/error.h"
#include "pbrt_import/mesh_files/polygon.h"
#include "pbrt_import/scene_format.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/pbrt_import/texture_images.h"

namespace packtrace {
namespace {

// Polygons

/// Twice the area of a triangulation in the plane z = 0, counted positive only if every triangle turns left.
double area_of(const std::vector<Vec3>& corners, const std::vector<std::array<uint32_t, 3>>& triangles) {
  double sum = 0.0;
  for (const auto& t : triangles) {
    const Vec3 a = corners[t[0]], b = corners[t[1]], c = corners[t[2]];
    const double twice = double{b.x - a.x} * (c.y - a.y) - double{c.x - a.x} * (b.y - a.y);
    if (twice < 0.0) return -1.0;
    sum += twice;
  }
  return sum;
}

std::vector<std::array<uint32_t, 3>> triangles_of(const std::vector<Vec3>& corners) {
  std::vector<std::array<uint32_t, 3>> triangles;
  triangulate_polygon(corners, triangles);
  return triangles;
}

TEST(Polygons, ConcaveOnesAreCoveredOnce) {
  const std::vector<Vec3> ell = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  for (size_t first = 0; first < ell.size(); ++first) { // whichever corner comes first
    std::vector<Vec3> turned;
    for (size_t i = 0; i < ell.size(); ++i) turned.push_back(ell[(first + i) % ell.size()]);
    EXPECT_DOUBLE_EQ(area_of(turned, triangles_of(turned)), 10.0) << first;
  }
  const std::vector<Vec3> arrow = {{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {1, 1, 0}}; // corner 3 points inwards
  for (size_t first = 0; first < arrow.size(); ++first) {
    std::vector<Vec3> turned;
    for (size_t i = 0; i < arrow.size(); ++i) turned.push_back(arrow[(first + i) % arrow.size()]);
    EXPECT_DOUBLE_EQ(area_of(turned, triangles_of(turned)), 2.0) << first;
  }
  std::vector<Vec3> star; // 40 corners, alternately far and near
  double twice = 0.0;
  for (int i = 0; i < 40; ++i) {
    const double angle = i * std::numbers::pi / 20, radius = i % 2 == 0 ? 1.0 : 0.3;
    star.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0.0);
  }
  for (size_t i = 0; i < star.size(); ++i) {
    const Vec3 a = star[i], b = star[(i + 1) % star.size()];
    twice += double{a.x} * b.y - double{a.y} * b.x;
  }
  EXPECT_NEAR(area_of(star, triangles_of(star)), twice, 1e-6);
}

TEST(Polygons, AllHaveTwoTrianglesLessThanCorners) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Vec3> large;
  for (size_t i = 0; i < kMaxEarCorners + 5; ++i) {
    const double angle = 0.001 * static_cast<double>(i);
    large.emplace_back(std::cos(angle), std::sin(angle), 0.0);
  }
  for (const std::vector<Vec3>& corners :
       std::vector<std::vector<Vec3>>{{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}, {2, 2, 0}}, // crosses itself
                                      {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, // a point
                                      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}}, // a line
                                      {{nan, 0, 0}, {1, 0, 0}, {2, nan, 0}, {3, 0, 0}, {4, 0, 0}},
                                      {{1e38f, 0, 0}, {-1e38f, 0, 0}, {0, 1e38f, 0}, {3, 0, 1e38f}, {4, 0, 0}},
                                      large}) {
    const auto triangles = triangles_of(corners);
    EXPECT_EQ(triangles.size(), corners.size() - 2);
    for (const auto& triangle : triangles)
      for (const uint32_t corner : triangle) EXPECT_LT(corner, corners.size());
  }
}

// OBJ

constexpr std::string_view kQuadObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(ObjFiles, CornersWithEqualAttributesBecomeOneVertex) {
  const SceneFolder folder;
  const Imported imported =
      import_file(folder.write("a.obj", std::string(kQuadObj) + "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"
                                                                "f 1/1/1 2/2/1 3/3/1\nf -4/1/-1 -2/3/-1 -1/1/-1\n"));
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.meshes.size(), 1u);
  const Mesh& mesh = imported.scene.meshes[0];
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[1], Triangle(0, 2, 3));
  EXPECT_EQ(mesh.uvs[2], Vec2(1.0f, 1.0f));
  EXPECT_EQ(mesh.normals[3], Vec3(0.0f, 0.0f, 1.0f));
  EXPECT_EQ(imported.statistics.files_read, 1u);
}

TEST(ObjFiles, LinesMayBeContinuedAndEndInAnyWay) {
  const std::string lines =
      "\xef\xbb\xbf# comment\nv 0 0 0 # at zero\nv 1 \\\n 0 0\n\tv +1.0e0 1. -0 1.0\n\nf 1 \\\n2 \\\n3\n";
  const SceneFolder folder;
  for (const std::string_view end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c : lines) c == '\n' ? text += end : text += c;
    for (const std::string& content : {text, text.substr(0, text.size() - end.size())}) {
      const Imported imported = import_file(folder.write("a.obj", content));
      EXPECT_EQ(imported.text(), "");
      ASSERT_EQ(imported.scene.meshes.size(), 1u);
      EXPECT_EQ(imported.scene.meshes[0].positions[2], Vec3(1.0f, 1.0f, 0.0f));
    }
  }
}

TEST(ObjFiles, ShapesFollowObjectsMaterialsAndAttributes) {
  const SceneFolder folder;
  folder.write("m.mtl", "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n");
  const Imported imported = import_file(
      folder.write("a.obj", "mtllib m.mtl\n" + std::string(kQuadObj) +
                                "vn 0 0 1\nusemtl a\no first\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl a\nf 1 3 4\n"
                                "o second\nf 1 2 3\nf 1//1 2//1 3//1\nf 1//1 2//1 3\n"));
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.shapes.size(), 4u);
  std::vector<size_t> triangles;
  for (const Shape& shape : imported.scene.shapes)
    triangles.push_back(imported.scene.meshes[shape.mesh].triangles.size());
  EXPECT_EQ(triangles, (std::vector<size_t>{2, 1, 2, 1}));
  EXPECT_EQ(imported.scene.materials[imported.scene.shapes[1].material].albedo, Vec3(0.0f, 1.0f, 0.0f));
  EXPECT_TRUE(imported.scene.meshes[imported.scene.shapes[2].mesh].normals.empty());
  EXPECT_EQ(imported.scene.meshes[imported.scene.shapes[3].mesh].normals.size(), 3u);
}

/// Imports a triangle whose material has these statements.
Imported import_material(const SceneFolder& folder, const std::string& statements) {
  folder.write("m.mtl", "newmtl m\n" + statements);
  return import_file(folder.write("a.obj", "mtllib m.mtl\nusemtl m\n" + std::string(kQuadObj) +
                                               "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"));
}

TEST(ObjFiles, MaterialsKeepColourLightAndTransparency) {
  const SceneFolder folder;
  EXPECT_EQ(only_material(import_material(folder, "Kd 0.25 0.5 0.75\n")).albedo, Vec3(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(only_material(import_material(folder, "Kd 0.25\nKs 1 1 1\nNs 40\n")).albedo, Vec3(0.25f));
  EXPECT_EQ(only_material(import_material(folder, "Ke 2 2 2\n")).flags, kEmissive);
  EXPECT_EQ(only_material(import_material(folder, "d 0.1\n")).flags, kTransmissive);
  EXPECT_EQ(only_material(import_material(folder, "Tr 0.3\nillum 4\n")).flags, kTransmissive);
  EXPECT_EQ(only_material(import_material(folder, "d 0.9\n")).flags, 0u);
  EXPECT_EQ(only_material(import_material(folder, "Pm 1\nPr 0.2\nKd 0.9 0.6 0.3\n")).flags, kMetal);
  const Imported absent = import_material(folder, "d 0\n");
  EXPECT_EQ(absent.scene.shapes.size(), 0u);
  EXPECT_EQ(absent.statistics.shapes_absent, 1u);
}

TEST(ObjFiles, TexturesAreFoundBesideTheMaterialFile) {
  const SceneFolder folder;
  folder.write("images/two words.tga", grey_tga(2, 1, {0, 255}));
  ImportOptions options;
  options.keep_textures = true;
  folder.write("m.mtl", "newmtl m\nKd 1 1 1\nmap_Kd -s 2 3 1 -o .5 -clamp on images\\two words.tga\n"
                        "map_d -imfchan l images/two words.tga\n");
  const Imported imported = import_file(
      folder.write("a.obj", "mtllib m.mtl\nusemtl m\n" + std::string(kQuadObj) + "vt 0 0\nf 1/1 2/1 3/1\n"), options);
  EXPECT_EQ(imported.text(), "");
  const Material material = only_material(imported);
  EXPECT_EQ(material.flags, kAlphaMask | kAlbedoTexture);
  ASSERT_EQ(imported.scene.textures.size(), 1u);
  EXPECT_EQ(imported.scene.textures[0].uv_scale, Vec2(2.0f, 3.0f));
  EXPECT_EQ(imported.scene.textures[0].uv_offset, Vec2(0.5f, 0.0f));
  EXPECT_EQ(imported.scene.textures[0].wrap, WrapMode::kClamp);
}

TEST(ObjFiles, OpacityMapsHaveACutoff) {
  const SceneFolder folder;
  // 2 x 1 grey pixels, 100 and 200.
  folder.write("a.tga", std::string("\0\0\3\0\0\0\0\0\0\0\0\0\2\0\1\0\10\0", 18) + "\x64\xc8");
  folder.write("m.mtl", "newmtl m\nmap_d a.tga\n");
  const Imported imported = import_file(
      folder.write("a.obj", "mtllib m.mtl\nusemtl m\n" + std::string(kQuadObj) + "vt 0 0\nf 1/1 2/1 3/1\n"), {});
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.masks.size(), 1u);
  EXPECT_EQ(imported.scene.masks[0].words[0], 2u); // the second pixel only
}

TEST(ObjFiles, MistakesAreReportedWhereTheyAre) {
  const SceneFolder folder;
  folder.write("m.mtl", "Kd 1 1 1\nnewmtl steel\nKd one\nNs\nKd -1 0 0\nmap_Kd\n");
  const Imported imported = import_file(folder.write(
      "a.obj", "mtllib m.mtl\nmtllib none.mtl\nusemtl stel\n" + std::string(kQuadObj) +
                   "v 0 zero 0\nvt\nf 1 2 3\nf 1 2 9\nf 1 2 0\nf 1 2 x\nf 1 2\nf 1 2 5\nl 1 2\nsurf 0 1\nquad 1 2 3\n"
                   "f 1 2 99999999999999999999\nf 1 2 3/7\n"));
  for (const char* const expected :
       {"m.mtl:1:1: error: \"Kd\" before the first newmtl", "m.mtl:3:1: error: Kd takes numbers",
        "m.mtl:4:1: error: Ns takes a number", "m.mtl:5:1: error: Kd takes one or three numbers",
        "m.mtl:6:1: error: a texture without a file name", "a.obj:2:1: error: material file",
        "a.obj:3:1: error: no material \"stel\" in the material files; its faces are grey; did you mean \"steel\"?",
        "a.obj:8:5: error: v takes 3 numbers, found \"zero\"", "a.obj:9:3: error: vt takes 2 numbers",
        "a.obj:11:7: error: a face with a corner that is not defined", "(5 times, first here)",
        "a.obj:14:1: error: a face with fewer than three corners", "a.obj:16:1: warning: points and lines",
        "a.obj:17:1: error: free-form", "a.obj:18:1: error: unknown statement \"quad\""})
    EXPECT_TRUE(imported.reported(expected)) << expected << "\n" << imported.text();
  ASSERT_EQ(imported.scene.meshes.size(), 1u);
  EXPECT_EQ(imported.scene.meshes[0].triangles.size(), 1u); // that with the malformed vertex is dropped
  EXPECT_EQ(imported.scene.dropped_triangles, 1u);
}

TEST(ObjFiles, WhatIsLeftOutIsReportedWhereItIs) {
  const SceneFolder folder;
  folder.write("a.tga", grey_tga(2, 1, {0, 255}));
  folder.write("m.mtl", "newmtl a\nKa 1 1 1\nd 0.2\nmap_Kd a.tga\nmap_Ks a.tga\nnewmtl b\nd 0.7\n"
                        "bump -mm 0 2 a.tga\nmap_Kd -t 1 1 1 -imfchan m a.tga\nmap_Ks a.tga\n");
  const Imported imported = import_file(
      folder.write("a.obj", "mtllib m.mtl\nusemap x\nusemtl a\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0 1\ns 1\nf 1 2 3\n"));
  for (const char* const expected :
       {"m.mtl:4:1: warning: glass has no image", "m.mtl:5:1: warning: \"map_Ks\" is left out (2 times, first here)",
        "m.mtl:6:1: warning: materials that are partly transparent are opaque",
        "m.mtl:8:1: warning: normal and bump maps are left out", "m.mtl:8:6: warning: the option \"-mm\"",
        "m.mtl:9:8: warning: the option \"-t\"", "m.mtl:9:17: warning: the option \"-imfchan\"",
        "a.obj:2:1: warning: \"usemap\" is left out", "a.obj:4:9: warning: colours of vertices are left out",
        "a.obj:7:1: warning: smoothing groups are left out"})
    EXPECT_TRUE(imported.reported(expected)) << expected << "\n" << imported.text();
  EXPECT_FALSE(imported.reported("\"Ka\"")) << imported.text();
  const Imported plain = import_file(folder.write("b.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0 1\ns off\nf 1 2 3\n"));
  EXPECT_EQ(plain.text(), "");
}

TEST(ObjFiles, MemoryIsLimited) {
  const SceneFolder folder;
  std::string text;
  for (int i = 0; i < 40'000; ++i) text += "v 0 1 2\n";
  for (int i = 1; i + 2 < 40'000; ++i) text += numbered("f ", i) + numbered(" ", i + 1) + numbered(" ", i + 2) + "\n";
  const auto file = folder.write("a.obj", text);
  ImportOptions options;
  options.memory = MemoryBudget(2u << 20);
  try {
    import_file(file, options);
    FAIL();
  } catch (const MemoryError& error) {
    EXPECT_TRUE(std::string(error.what()).find("a.obj") != std::string::npos) << error.what();
  }
}

// STL

std::string binary_stl(const std::vector<Vec3>& corners, const std::string& title = "solid, but binary") {
  std::string file = title;
  file.resize(80, ' ');
  const auto count = static_cast<uint32_t>(corners.size() / 3);
  file.append(reinterpret_cast<const char*>(&count), 4);
  for (size_t i = 0; i < corners.size(); i += 3) {
    const Vec3 normal(0.0f);
    file.append(reinterpret_cast<const char*>(&normal), 12).append(reinterpret_cast<const char*>(&corners[i]), 36);
    file.append(2, '\0');
  }
  return file;
}

const std::vector<Vec3> kTwoTriangles = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {-0.0f, 1, 0}};
constexpr std::string_view kTextStl =
    "solid two triangles\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 1 0\n endloop\n"
    "endfacet\nfacet normal 0 0 1\n outer loop\n  vertex -0 0 0\n  vertex 1.0 1 0\n  vertex 0 1e0 0\n "
    "endloop\nendfacet\n"
    "endsolid two triangles\n";

TEST(StlFiles, BinaryAndTextGiveTheSameMesh) {
  const SceneFolder folder;
  for (const auto& file : {folder.write("a.stl", binary_stl(kTwoTriangles)), folder.write("b.STL", kTextStl)}) {
    const Imported imported = import_file(file);
    EXPECT_EQ(imported.text(), "");
    ASSERT_EQ(imported.scene.meshes.size(), 1u);
    EXPECT_EQ(imported.scene.meshes[0].positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(imported.scene.meshes[0].triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  }
}

TEST(StlFiles, ColoursAreReported) {
  const SceneFolder folder;
  std::string binary = binary_stl(kTwoTriangles);
  binary.back() = '\x80';
  EXPECT_TRUE(import_file(folder.write("a.stl", binary)).reported("a.stl: warning: colours of triangles are left out"));
  std::string text(kTextStl);
  text.insert(text.find("facet"), "color 1 0 0\n");
  EXPECT_TRUE(import_file(folder.write("b.stl", text)).reported("b.stl:2:1: warning: colours of triangles"));
}

TEST(StlFiles, DamageIsReported) {
  const SceneFolder folder;
  const std::string whole = binary_stl(kTwoTriangles, "binary");
  for (const size_t size : {size_t{0}, size_t{83}, size_t{84}, whole.size() - 1}) {
    try {
      import_file(folder.write("a.stl", whole.substr(0, size)));
      FAIL() << size;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_TRUE(std::string(error.what()).find("a.stl: ") != std::string::npos) << error.what();
    }
  }
  const Imported text = import_file(folder.write(
      "b.stl", "solid\nvertex 0 0 0\nvertex 1 0 0\nendloop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 1 1 1\n"
               "endloop\nvertex a 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nfaset\nendsolid\n"));
  for (const char* const expected :
       {"b.stl:4:1: error: a loop with fewer than three corners", "b.stl:8:1: error: a loop with more than three",
        "b.stl:10:1: error: vertex takes three numbers", "b.stl:14:1: error: unknown statement \"faset\""})
    EXPECT_TRUE(text.reported(expected)) << expected << "\n" << text.text();
  EXPECT_EQ(unique_triangle_count(text.scene), 1u);
}

// All formats

TEST(MeshFiles, FormatsAreRecognised) {
  const SceneFolder folder;
  EXPECT_EQ(scene_format("a.OBJ"), SceneFormat::kObj);
  EXPECT_EQ(scene_format("b.stl.gz"), SceneFormat::kStl);
  EXPECT_EQ(scene_format("ply/scene.pbrt"), SceneFormat::kPbrt);
  EXPECT_EQ(scene_format(folder.write("mesh", kPly)), SceneFormat::kPly);
  EXPECT_EQ(scene_format(folder.write("mesh.txt", "v 0 0 0\n")), SceneFormat::kPbrt);
  EXPECT_EQ(scene_format(folder / "missing"), SceneFormat::kPbrt);
}

TEST(MeshFiles, CoordinatesAreTurnedScaledAndMirrored) {
  const SceneFolder folder;
  const auto file = folder.write("a.obj", "v 1 2 3\nv 2 2 3\nv 1 3 3\nf 1 2 3\n");
  for (const auto& [up, expected] :
       {std::pair{UpAxis::kX, DVec3(4, 2, 6)}, {UpAxis::kY, DVec3(-2, 4, 6)}, {UpAxis::kZ, DVec3(-2, 6, -4)}}) {
    ImportOptions options;
    options.mesh_up = up, options.mesh_scale = 2.0;
    const Imported imported = import_file(file, options);
    ASSERT_EQ(imported.scene.shapes.size(), 1u);
    EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 0), expected);
    // Right-handed coordinates become left-handed ones: the map mirrors.
    EXPECT_LT(glm::determinant(glm::dmat3(imported.scene.shapes[0].parent_from_mesh)), 0.0);
  }
}

TEST(MeshFiles, SeveralMakeOneScene) {
  const SceneFolder folder;
  folder.write("x/m.mtl", "newmtl m\nKd 1 0 0\n");
  folder.write("y/m.mtl", "newmtl m\nKd 0 0 1\n");
  const std::string obj = "mtllib m.mtl\nusemtl m\n" + std::string(kQuadObj) + "f 1 2 3 4\n";
  const std::vector<std::filesystem::path> files = {folder.write("x/a.obj", obj), folder.write("b.ply", kPly),
                                                    folder.write("y/a.obj", obj),
                                                    folder.write("c.stl", binary_stl(kTwoTriangles))};
  Diagnostics diagnostics;
  Progress progress;
  const ImportResult result = import_mesh_files(files, {}, diagnostics, progress);
  EXPECT_TRUE(diagnostics.entries().empty());
  ASSERT_EQ(result.scene.shapes.size(), 4u);
  EXPECT_EQ(unique_triangle_count(result.scene), 7u);
  EXPECT_EQ(result.scene.materials[result.scene.shapes[0].material].albedo, Vec3(1.0f, 0.0f, 0.0f));
  EXPECT_EQ(result.scene.materials[result.scene.shapes[2].material].albedo, Vec3(0.0f, 0.0f, 1.0f));
  EXPECT_EQ(result.statistics.files_read, 6u);
  EXPECT_EQ(result.files.size(), 7u); // the PLY file is named by its shape too
}

TEST(MeshFiles, EveryPrefixAndFlippedByteEndsWell) {
  const SceneFolder folder;
  folder.write("m.mtl", "newmtl m\nKd 1 1 1\n");
  const std::string obj = "mtllib m.mtl\nusemtl m\n" + std::string(kQuadObj) +
                          "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1 -2 \\\n-3\nl 1 2\n";
  for (const auto& [name, text] :
       {std::pair{"a.obj", obj}, {"a.stl", std::string(kTextStl)}, {"b.stl", binary_stl(kTwoTriangles, "binary")}}) {
    for (size_t i = 0; i < text.size(); ++i) {
      std::string flipped = text;
      flipped[i] = static_cast<char>(flipped[i] ^ (1 << i % 8));
      for (const std::string& content : {text.substr(0, i), flipped}) {
        try {
          import_file(folder.write(name, content));
        } catch (const Error& error) {
          EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
        }
      }
    }
  }
}

} // namespace
} // namespace packtrace
