#include "pbrt_import/import_scene.h"

#include <oneapi/tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/language/transforms.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

// Shapes

TEST(Shapes, EveryQuadricHasItsDefaults) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "Shape \"sphere\" Shape \"cylinder\" Shape \"disk\" Shape \"cone\" "
                                                 "Shape \"paraboloid\" Shape \"hyperboloid\"");
  EXPECT_EQ(imported.scene.shapes.size(), 6u) << imported.text();
  EXPECT_EQ(imported.count(Severity::kError), 0u) << imported.text();
  const Bounds sphere = bounds_of(imported.scene.meshes[0].positions);
  EXPECT_NEAR(sphere.hi.z, 1.0, 1e-6);
  EXPECT_NEAR(sphere.lo.x, -1.0, 1e-2);
}

TEST(Shapes, SphereLimitsFollowTheRadius) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "Shape \"sphere\" \"float radius\" 3");
  EXPECT_NEAR(world_bounds(imported.scene).lo.z, -3.0, 1e-6);
}

TEST(Shapes, EqualQuadricsShareAMesh) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Shape \"sphere\" Translate 9 0 0 Shape \"sphere\" \"float radius\" 2.5 "
                           "Shape \"sphere\" \"float zmax\" .5 Shape \"disk\" Shape \"disk\" "
                           "Shape \"disk\" \"float height\" 1");
  ASSERT_EQ(imported.scene.shapes.size(), 6u) << imported.text();
  const auto mesh = [&](size_t shape) { return imported.scene.shapes[shape].mesh; };
  EXPECT_EQ(mesh(0), mesh(1)); // whole spheres only differ in scale
  EXPECT_NE(mesh(0), mesh(2));
  EXPECT_EQ(mesh(3), mesh(4));
  EXPECT_NE(mesh(4), mesh(5));
  EXPECT_EQ(imported.scene.shapes[1].parent_from_mesh, compose(translation({9, 0, 0}), scaling(DVec3(2.5))));
}

TEST(Shapes, MeshesMadeByOtherThreadsKeepTheirOrderAndTheirReports) {
  const SceneFolder folder;
  std::string text;
  for (int i = 0; i < 40; ++i) { // large enough for separate tasks; every third one has a bad triangle
    std::string indices, points;
    for (int k = 0; k < 2000; ++k) {
      indices += "0 1 2 ";
      points += std::to_string(i) + " " + std::to_string(k) + " 0 1 0 0 0 1 0 ";
    }
    if (i % 3 == 0) indices += "0 1 " + std::to_string(100'000 + i);
    text += "Shape \"trianglemesh\" \"integer indices\" [" + indices + "] \"point P\" [" + points + "]\n";
    if (i % 7 == 0) text += "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0]\n";
  }
  std::vector<std::string> reports;
  for (const size_t threads : {size_t{1}, size_t{4}}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism, threads);
    const Imported imported = import_world(folder, text);
    ASSERT_EQ(imported.scene.shapes.size(), 40u);
    for (int i = 0; i < 40; ++i) {
      const Mesh& mesh = imported.scene.meshes[imported.scene.shapes[static_cast<size_t>(i)].mesh];
      ASSERT_EQ(mesh.triangles.size(), 2000u);
      ASSERT_EQ(mesh.positions[0].x, static_cast<float>(i));
    }
    EXPECT_EQ(imported.scene.dropped_triangles, 14u + 6u);
    EXPECT_EQ(imported.statistics.shapes_skipped, 6u);
    reports.push_back(imported.text());
  }
  EXPECT_EQ(reports[0], reports[1]);
}

TEST(Shapes, LoopSubdivisionTakesBothSpellingsOfLevels) {
  const SceneFolder folder;
  const std::string data = " \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] ";
  const Imported imported =
      import_world(folder, "Shape \"loopsubdiv\" \"integer levels\" 1" + data +
                               "Shape \"loopsubdiv\" \"integer nlevels\" 2" + data + "Shape \"loopsubdiv\"" + data);
  ASSERT_EQ(imported.scene.meshes.size(), 3u);
  EXPECT_EQ(imported.scene.meshes[0].triangles.size(), 4u);
  EXPECT_EQ(imported.scene.meshes[1].triangles.size(), 16u);
  EXPECT_EQ(imported.scene.meshes[2].triangles.size(), 64u);
}

TEST(Shapes, AbsurdSubdivisionIsRefused) {
  const SceneFolder folder;
  const std::string data = " \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] ";
  const Imported imported =
      import_world(folder, "Shape \"loopsubdiv\" \"integer levels\" 30" + data +
                               "Shape \"loopsubdiv\" \"integer levels\" -1" + data + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_EQ(imported.count(Severity::kError), 2u) << imported.text();
}

TEST(Shapes, AllSpellingsOfTextureCoordinatesAreRead) {
  const SceneFolder folder;
  for (const std::string uv : {"point2 uv", "float uv", "point2 st", "float st"}) {
    std::string world(kTriangle);
    world.append("\"").append(uv).append("\" [0 0 0.5 0 0 0.25]");
    const Imported imported = import_world(folder, world);
    ASSERT_EQ(imported.scene.meshes.size(), 1u);
    ASSERT_EQ(imported.scene.meshes[0].uvs.size(), 3u) << uv;
    EXPECT_EQ(imported.scene.meshes[0].uvs[2], Vec2(0, 0.25f));
    EXPECT_EQ(imported.text(), "") << uv;
  }
}

TEST(Shapes, BadIndicesDropTheirTrianglesOnly) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 1 3  -1 0 1  0 1 3000000000  "
                           "0 0 1] \"point P\" [0 0 0 1 0 0 0 1 0]");
  EXPECT_EQ(imported.statistics.triangles, 1u);
  EXPECT_EQ(imported.scene.dropped_triangles, 4u);
  EXPECT_TRUE(imported.reported("trianglemesh: 3 triangles")) << imported.text();
}

TEST(Shapes, NonFiniteVerticesDropTheirTrianglesOnly) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Shape \"trianglemesh\" \"integer indices\" [0 1 2 1 2 3 2 3 4] \"point P\" "
                           "[0 0 0 1 0 0 0 1 0  nan 0 0  1e400 0 0]");
  EXPECT_EQ(imported.statistics.triangles, 1u);
  EXPECT_EQ(imported.scene.dropped_triangles, 2u);
  for (const Vec3 p : imported.scene.meshes[0].positions) EXPECT_TRUE(is_finite(p));
}

TEST(Shapes, MissingDataIsNamed) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Shape \"trianglemesh\" \"point P\" [0 0 0]\nShape \"trianglemesh\" \"integer indices\" [0 "
                           "1 2]\nShape \"plymesh\"\n"
                           "Shape \"trianglemesh\" \"integer indices\" [5 6 7] \"point P\" [0 0 0 1 0 0 0 1 0]");
  EXPECT_TRUE(imported.scene.shapes.empty());
  EXPECT_EQ(imported.statistics.shapes_skipped, 4u);
  EXPECT_TRUE(imported.reported("1:12: error: Shape \"trianglemesh\" is skipped: no \"integer indices\""))
      << imported.text();
  EXPECT_TRUE(imported.reported("2:1: error: Shape \"trianglemesh\" is skipped: no \"point P\""));
  EXPECT_TRUE(imported.reported("3:1: error: plymesh without a \"string filename\""));
  EXPECT_TRUE(imported.reported("4:1: error: Shape \"trianglemesh\" is skipped: no triangle is left"));
}

TEST(Shapes, UnknownOnesAreNamed) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "Shape \"spere\" Shape \"teapot\"" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(imported.reported("Shape \"spere\" is skipped: unknown shape; did you mean \"sphere\"?"));
  EXPECT_TRUE(imported.reported("Shape \"teapot\" is skipped: unknown shape\n"));
  EXPECT_EQ(imported.statistics.shapes.at("unknown"), 2u);
}

TEST(Shapes, CurvesNurbsAndHeightfieldsAreRead) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder,
      "Shape \"curve\" \"string type\" \"cylinder\" \"point P\" [0 0 0 1 0 0 2 1 0 3 1 0] \"float width\" 0.1\n"
      "Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2 \"float uknots\" "
      "[0 0 1 1] \"float vknots\" [0 0 1 1] \"point P\" [0 0 0 1 0 0 0 1 0 1 1 0]\n"
      "Shape \"heightfield\" \"integer nu\" 3 \"integer nv\" 2 \"float Pz\" [0 1 0 1 0 1]\n");
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.meshes.size(), 3u);
  EXPECT_EQ(imported.scene.meshes[2].triangles.size(), 4u);
}

TEST(Shapes, AbsurdCountsAreRefused) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder,
      "Shape \"heightfield\" \"integer nu\" 2000000000 \"integer nv\" 2000000000 \"float Pz\" [0 1]\n"
      "Shape \"heightfield\" \"integer nu\" -3 \"integer nv\" 2 \"float Pz\" [0 1]\n"
      "Shape \"nurbs\" \"integer nu\" 2000000000 \"integer nv\" 2000000000 \"integer uorder\" 2 \"integer vorder\" 2 "
      "\"point P\" [0 0 0]\nShape \"curve\" \"string type\" \"round\" \"point P\" [0 0 0 1 0 0 2 1 0 3 1 0]\n" +
          std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 2u); // pbrt also draws the curve
  EXPECT_EQ(imported.count(Severity::kError), 4u) << imported.text();
  EXPECT_TRUE(imported.reported("is skipped: negative \"nu\""));
}

TEST(Shapes, FlattenedShapesAreSkipped) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "AttributeBegin Scale 1 0 1" + std::string(kTriangle) +
                                                     "AttributeEnd" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(imported.reported("error: the shape's transform has no inverse"));
}

TEST(Shapes, UnusedParametersAreReportedWithAHint) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "Shape \"sphere\" \"float radus\" 2 \"integer radius\" 3");
  EXPECT_TRUE(imported.reported("warning: parameter \"float radus\" is not used; did you mean \"radius\"?"));
  EXPECT_TRUE(imported.reported("warning: parameter \"integer radius\" is ignored: it has the wrong type"));
}

TEST(Shapes, OneBadParameterCostsItselfOnly) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Shape \"sphere\" \"float radius\" [ oops ]\n" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 2u);
  EXPECT_EQ(imported.count(Severity::kError), 1u) << imported.text();
}

TEST(Shapes, MemoryBudgetIsKept) {
  const SceneFolder folder;
  ImportOptions options;
  const std::string text = std::string(kTriangle) + "\nShape \"sphere\"\n" + std::string(kTriangle);
  options.memory = MemoryBudget(1 << 20);
  EXPECT_EQ(import_world(folder, text, options).scene.shapes.size(), 3u);
  EXPECT_EQ(options.memory.used(), 0u);
  options.memory = MemoryBudget(1000);
  try {
    (void)import_world(folder, text, options);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    const std::string message = error.what();
    EXPECT_NE(message.find("scene.pbrt:"), std::string::npos) << message;
    EXPECT_NE(message.find(":1: the shape needs "), std::string::npos) << message;
    EXPECT_NE(message.find(" of memory, of 1000 bytes left; --max-memory raises it"), std::string::npos) << message;
  }
}

// PLY files

TEST(PlyShapes, SameFileIsReadOnceAndShared) {
  const SceneFolder folder;
  folder.write("m/a.ply", kPly);
  const Imported imported = import_world(folder, ply_shape("m/a.ply") + ply_shape("./m/../m/a.ply") +
                                                     "Material \"mirror\" " + ply_shape("m/a.ply"));
  EXPECT_EQ(imported.scene.meshes.size(), 1u) << imported.text();
  EXPECT_EQ(imported.scene.shapes.size(), 3u);
  EXPECT_EQ(imported.scene.materials.size(), 2u);
  EXPECT_EQ(imported.statistics.files_read, 2u);
}

TEST(PlyShapes, OneMissingFileCostsOneShape) {
  const SceneFolder folder;
  folder.write("a.ply", kPly);
  const Imported imported =
      import_world(folder, "\n" + ply_shape("a.ply") + ply_shape("gone.ply") + ply_shape("a.ply"));
  EXPECT_EQ(imported.scene.shapes.size(), 2u);
  EXPECT_EQ(imported.count(Severity::kError), 1u);
  EXPECT_TRUE(imported.reported("scene.pbrt:3:1: error: plymesh ")) << imported.text();
  EXPECT_TRUE(imported.reported("gone.ply\": no such file; the shape is skipped"));
}

TEST(PlyShapes, MemoryBudgetHoldsForAllOfThemTogether) {
  const SceneFolder folder;
  std::string ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                    "element face 100\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n";
  for (int i = 0; i < 100; ++i) ply += "3 0 1 2\n";
  std::string text;
  for (int i = 0; i < 3; ++i) {
    folder.write(numbered("a", i), ply);
    text += "Shape \"plymesh\" \"string filename\" \"" + numbered("a", i) + "\"\n";
  }
  ImportOptions options;
  options.memory = MemoryBudget(100'000);
  EXPECT_EQ(import_world(folder, text, options).scene.shapes.size(), 3u);
  options.memory = MemoryBudget(3 * (3 * sizeof(Vec3) + 100 * sizeof(Triangle)));
  try {
    (void)import_world(folder, text, options);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("left; --max-memory raises it"), std::string::npos) << error.what();
  }
}

TEST(PlyShapes, TruncatedFilesAreDropped) {
  const SceneFolder folder;
  folder.write("a.ply", kPly.substr(0, kPly.size() - 12));
  folder.write("empty.ply", "");
  const Imported imported = import_world(folder, ply_shape("a.ply") + ply_shape("empty.ply") + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_EQ(imported.count(Severity::kError), 2u) << imported.text();
  EXPECT_EQ(imported.statistics.shapes_skipped, 2u);
}

TEST(PlyShapes, WindowsPathsAreFound) {
  const SceneFolder folder;
  folder.write("models/new.ply", kPly);
  const Imported imported = import_world(folder, ply_shape("models\\new.ply")); // \n is not a line feed here
  EXPECT_EQ(imported.scene.shapes.size(), 1u) << imported.text();
}

TEST(PlyShapes, FilesOutsideTheFolderCanBeForbidden) {
  const SceneFolder folder;
  folder.write("outside.ply", kPly);
  folder.write("scene/inside.ply", kPly);
  const auto scene = folder.write("scene/scene.pbrt",
                                  "WorldBegin\n" + ply_shape("../outside.ply") + ply_shape("inside.ply") + "WorldEnd");
  EXPECT_EQ(import_file(scene).scene.shapes.size(), 2u);
  ImportOptions options;
  options.allow_files_outside_scene_folder = false;
  const Imported confined = import_file(scene, options);
  EXPECT_EQ(confined.scene.shapes.size(), 1u);
  EXPECT_TRUE(confined.reported("error: file name \"../outside.ply\" leads out of the scene's folder"))
      << confined.text();
}

TEST(PlyShapes, ThreadsDoNotChangeTheResult) {
  const SceneFolder folder;
  std::string text;
  for (int i = 0; i < 40; ++i) {
    std::string ply(kPly);
    if (i % 3 == 0) ply.replace(ply.find("3 0 1 2"), 7, "3 0 1 9");
    if (i % 3 == 1) ply += "\n";
    const std::string name = numbered("m", i) + ".ply";
    folder.write(name, ply);
    text += ply_shape(name);
  }
  std::vector<std::string> texts;
  std::vector<size_t> shapes;
  for (const size_t threads : {size_t{1}, size_t{4}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Imported imported = import_world(folder, text);
    texts.push_back(imported.text());
    shapes.push_back(imported.scene.shapes.size());
    for (size_t i = 0; i + 1 < imported.scene.meshes.size(); ++i)
      EXPECT_NE(imported.scene.meshes[i].name, imported.scene.meshes[i + 1].name);
  }
  EXPECT_EQ(texts[0], texts[1]);
  EXPECT_EQ(shapes[0], shapes[1]);
  EXPECT_NE(texts[0], "");
}

} // namespace
} // namespace packtrace
