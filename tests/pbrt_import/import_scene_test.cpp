#include "pbrt_import/import_scene.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include <oneapi/tbb/global_control.h>

#include "pbrt_import/scene/error.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

constexpr std::string_view kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

std::string ply_shape(const std::string& file) { return "Shape \"plymesh\" \"string filename\" \"" + file + "\"\n"; }

DVec3 placed(const Shape& shape, const Scene& scene, size_t vertex) {
  return transform_point(shape.parent_from_mesh, DVec3(scene.meshes[shape.mesh].positions[vertex]));
}

Material material_of(const Imported& imported) {
  EXPECT_EQ(imported.scene.materials.size(), 1u) << imported.text();
  return imported.scene.materials.empty() ? Material{} : imported.scene.materials[0];
}

// Scene structure

TEST(ImportScene, EmptySceneIsReturned) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "");
  EXPECT_TRUE(imported.scene.shapes.empty());
  EXPECT_EQ(imported.text(), "");
  EXPECT_TRUE(import_text(folder, "").reported("warning: the file ends without WorldBegin"));
}

TEST(ImportScene, MissingMainFileThrows) {
  Diagnostics diagnostics;
  Progress progress;
  try {
    import_scene("/nonexistent/scene.pbrt", {}, diagnostics, progress);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_STREQ(error.what(), "/nonexistent/scene.pbrt: no such file");
  }
}

TEST(ImportScene, OptionsOutOfRangeThrow) {
  const SceneFolder folder;
  ImportOptions options;
  options.tessellation_tolerance = 0.0;
  EXPECT_THROW(import_world(folder, "", options), Error);
  options = {};
  options.max_nesting = 0;
  EXPECT_THROW(import_world(folder, "", options), Error);
}

TEST(ImportScene, TransformsPlaceShapes) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "Translate 10 0 0 AttributeBegin Scale 2 2 2 Rotate 90 0 0 1" +
                                                     std::string(kTriangle) + "AttributeEnd" + std::string(kTriangle));
  ASSERT_EQ(imported.scene.shapes.size(), 2u);
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 1), DVec3(10, 2, 0));
  EXPECT_EQ(placed(imported.scene.shapes[1], imported.scene, 1), DVec3(11, 0, 0));
}

TEST(ImportScene, WorldBeginResetsTheTransform) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, "Translate 5 5 5 WorldBegin" + std::string(kTriangle) + "WorldEnd");
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 0), DVec3(0.0));
}

TEST(ImportScene, NamedCoordinateSystemsComeBack) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Translate 0 0 5 Camera \"perspective\" WorldBegin Translate 1 2 3 CoordinateSystem \"here\" Identity "
              "CoordSysTransform \"here\"" +
                  std::string(kTriangle) + "CoordSysTransform \"camera\"" + std::string(kTriangle) +
                  "CoordSysTransform \"world\"" + std::string(kTriangle) + "CoordSysTransform \"gone\" WorldEnd");
  ASSERT_EQ(imported.scene.shapes.size(), 3u);
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 0), DVec3(1, 2, 3));
  EXPECT_EQ(placed(imported.scene.shapes[1], imported.scene, 0), DVec3(0, 0, -5));
  EXPECT_EQ(placed(imported.scene.shapes[2], imported.scene, 0), DVec3(0, 0, 0));
  EXPECT_TRUE(imported.reported("error: no coordinate system \"gone\""));
}

TEST(ImportScene, AnimatedShapesStandAtTheirStart) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "ActiveTransform EndTime Translate 5 0 0 ActiveTransform StartTime Translate 1 0 0 ActiveTransform All" +
                  std::string(kTriangle));
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 0), DVec3(1, 0, 0));
  EXPECT_TRUE(imported.reported("note: animated shape"));
}

TEST(ImportScene, ReverseOrientationIsScoped) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "AttributeBegin ReverseOrientation" + std::string(kTriangle) +
                                                     "AttributeEnd" + std::string(kTriangle));
  EXPECT_TRUE(imported.scene.shapes[0].reverse_orientation);
  EXPECT_FALSE(imported.scene.shapes[1].reverse_orientation);
}

// Objects

TEST(Objects, InstancesComposeWithTheObjectsOwnTransform) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Translate 1 0 0 ObjectBegin \"o\" Translate 0 1 0" + std::string(kTriangle) +
                               "ObjectEnd Translate 0 0 1 ObjectInstance \"o\" ObjectInstance \"o\"");
  ASSERT_EQ(imported.scene.objects.size(), 1u);
  ASSERT_EQ(imported.scene.instances.size(), 2u);
  EXPECT_TRUE(imported.scene.shapes.empty());
  // The transform at ObjectBegin is part of both: pbrt multiplies instance and shape transforms.
  EXPECT_EQ(placed(imported.scene.objects[0].shapes[0], imported.scene, 0), DVec3(1, 1, 0));
  EXPECT_EQ(imported.scene.instances[1].world_from_object[3], Vec3(1, 0, 1));
  EXPECT_EQ(placed_triangle_count(imported.scene), 2u);
}

TEST(Objects, UndefinedSelfAndNestedInstancesAreErrors) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "ObjectBegin \"tree\" ObjectInstance \"tree\"" + std::string(kTriangle) +
                  "ObjectEnd\nObjectBegin \"forest\" ObjectInstance \"tree\" ObjectEnd\nObjectInstance \"treee\" "
                  "ObjectInstance \"tree\"");
  EXPECT_EQ(imported.scene.instances.size(), 1u);
  EXPECT_TRUE(imported.reported("1:31: error: ObjectInstance \"tree\" inside object \"tree\"")) << imported.text();
  EXPECT_TRUE(imported.reported("2:22: error: ObjectInstance \"tree\" inside object \"forest\""));
  EXPECT_TRUE(imported.reported("3:1: error: no object \"treee\"; the instance is skipped; did you mean \"tree\"?"));
}

TEST(Objects, UnusedOnesAreLeftOutAndTheirFilesNotRead) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "ObjectBegin \"a\" " + ply_shape("gone.ply") + " ObjectEnd ObjectBegin \"b\"" + std::string(kTriangle) +
                  "ObjectEnd ObjectInstance \"b\" ObjectBegin \"empty\" ObjectEnd ObjectInstance \"empty\"");
  EXPECT_EQ(imported.count(Severity::kError), 0u) << imported.text();
  EXPECT_TRUE(imported.reported("note: object \"a\" is never instanced"));
  ASSERT_EQ(imported.scene.objects.size(), 1u);
  EXPECT_EQ(imported.scene.objects[0].name, "b");
  ASSERT_EQ(imported.scene.instances.size(), 1u);
  EXPECT_EQ(imported.scene.instances[0].object, 0u);
  EXPECT_EQ(imported.scene.meshes.size(), 1u);
}

TEST(Objects, NestedDefinitionsEndInOrder) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "ObjectBegin \"a\" ObjectBegin \"b\"" + std::string(kTriangle) + "ObjectEnd" +
                               std::string(kTriangle) + "ObjectEnd" + std::string(kTriangle) + "ObjectInstance \"a\"");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  ASSERT_EQ(imported.scene.objects.size(), 1u);
  EXPECT_EQ(imported.scene.objects[0].shapes.size(), 2u);
  EXPECT_TRUE(imported.reported("error: ObjectBegin \"b\" inside object \"a\""));
}

TEST(Objects, FlatInstancesAreSkipped) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "ObjectBegin \"o\"" + std::string(kTriangle) +
                                                     "ObjectEnd ObjectInstance \"o\" Scale 1 0 1 ObjectInstance \"o\"");
  EXPECT_EQ(imported.scene.instances.size(), 1u);
  EXPECT_TRUE(imported.reported("error: the instance's transform has no inverse"));
}

TEST(Objects, AreaLightsInsideDoNotEmit) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "ObjectBegin \"o\" AreaLightSource \"diffuse\"" +
                                                     std::string(kTriangle) + "ObjectEnd ObjectInstance \"o\"");
  EXPECT_EQ(material_of(imported).flags, 0u);
  EXPECT_TRUE(imported.reported("warning: area lights in objects do not emit"));
}

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
  EXPECT_NEAR(bounds_of(imported.scene.meshes[0].positions).lo.z, -3.0, 1e-6);
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
  for (const char* const uv : {"point2 uv", "float uv", "point2 st", "float st"}) {
    const Imported imported = import_world(folder, std::string(kTriangle) + "\"" + uv + "\" [0 0 0.5 0 0 0.25]");
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
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
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

TEST(Shapes, DamagedDirectivesMakeNoShape) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Shape \"sphere\" \"float radius\" [ oops ]\n" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_EQ(imported.count(Severity::kError), 1u) << imported.text();
}

TEST(Shapes, MemoryBudgetIsKept) {
  const SceneFolder folder;
  ImportOptions options;
  options.memory_budget_bytes = 1000;
  const Imported imported =
      import_world(folder, std::string(kTriangle) + "\nShape \"sphere\"\n" + std::string(kTriangle), options);
  EXPECT_EQ(imported.scene.shapes.size(), 2u);
  EXPECT_TRUE(
      imported.reported("Shape \"sphere\" is skipped: all meshes together exceed the memory budget of 1000 bytes"))
      << imported.text();
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
  const Imported imported = import_world(folder, ply_shape("models\\new.ply")); // \n is not a line end here
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

// Blocks

TEST(Blocks, CrossedBlocksNameBothPlaces) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "AttributeBegin\n Translate 1 0 0 TransformBegin\nAttributeEnd\nTransformEnd" + std::string(kTriangle));
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 0), DVec3(0.0));
  EXPECT_TRUE(imported.reported("scene.pbrt:3:1: error: AttributeEnd closes the TransformBegin at "))
      << imported.text();
  EXPECT_TRUE(imported.reported("scene.pbrt:2:18, which has no TransformEnd before it"));
  EXPECT_TRUE(imported.reported("scene.pbrt:4:1: error: TransformEnd without TransformBegin"));
}

TEST(Blocks, EndsWithoutBeginAreErrors) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "AttributeEnd ObjectEnd\nTransformBegin AttributeEnd TransformEnd" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(imported.reported("1:12: error: AttributeEnd without AttributeBegin"));
  EXPECT_TRUE(imported.reported("error: ObjectEnd without ObjectBegin"));
  EXPECT_TRUE(imported.reported("the innermost open block is the TransformBegin at "));
}

TEST(Blocks, OpenBlocksAtTheEndAreNamed) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "AttributeBegin" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(imported.reported("1:12: warning: AttributeBegin without its AttributeEnd before the world ends at "));
}

TEST(Blocks, MissingWorldEndKeepsTheScene) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, "WorldBegin" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(imported.reported("warning: the file ends without WorldEnd"));
}

TEST(Blocks, DeepNestingIsHeldUpToTheLimit) {
  const SceneFolder folder;
  std::string text;
  for (int i = 0; i < 5000; ++i) text += "AttributeBegin Translate 1 0 0\n";
  text += kTriangle;
  for (int i = 0; i < 5000; ++i) text += "AttributeEnd\n";
  text += kTriangle;
  const Imported deep = import_world(folder, text);
  EXPECT_EQ(deep.text(), "");
  EXPECT_EQ(placed(deep.scene.shapes[0], deep.scene, 0), DVec3(5000, 0, 0));
  EXPECT_EQ(placed(deep.scene.shapes[1], deep.scene, 0), DVec3(0, 0, 0));
  ImportOptions options;
  options.max_nesting = 100;
  const Imported limited = import_world(folder, text, options);
  EXPECT_EQ(placed(limited.scene.shapes[1], limited.scene, 0), DVec3(0, 0, 0));
  EXPECT_EQ(limited.count(Severity::kError), 4900u);
  EXPECT_TRUE(limited.reported("blocks are nested more than 100 deep"));
}

TEST(Blocks, DirectivesBelongToTheirPartOfTheFile) {
  const SceneFolder folder;
  const Imported imported =
      import_text(folder, std::string(kTriangle) + "WorldBegin Film \"image\"" + std::string(kTriangle) + "WorldEnd" +
                              std::string(kTriangle) + "WorldBegin" + std::string(kTriangle) + "WorldEnd");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(
      imported.reported("error: Shape belongs between WorldBegin and WorldEnd; it is ignored (2 times, first here)"));
  EXPECT_TRUE(imported.reported("error: Film belongs before WorldBegin; it is ignored"));
  EXPECT_TRUE(imported.reported("error: a second world block"));
}

TEST(Blocks, BadTransformsAreIgnored) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "Translate nan 0 0 Scale 1e999 1 1 Rotate 30 0 0 0 LookAt 0 0 0 0 0 0 "
                                                 "0 1 0 Transform [1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1] "
                                                 "ActiveTransform Never" +
                                                     std::string(kTriangle));
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 1), DVec3(1, 0, 0));
  EXPECT_EQ(imported.count(Severity::kError), 6u) << imported.text();
  EXPECT_TRUE(imported.reported("Translate is ignored: a number is not finite"));
  EXPECT_TRUE(imported.reported("Rotate is ignored: the axis has no direction"));
  EXPECT_TRUE(imported.reported("Transform is ignored: the matrix is not affine"));
}

// Materials and lights

TEST(Materials, KindsHaveTheirAlbedoAndFlags) {
  const SceneFolder folder;
  struct Case {
    const char* text;
    float albedo;
    MaterialFlags flags;
  };
  for (const Case& c : {Case{"", 0.5f, 0},
                        {"Material \"matte\"", 0.5f, 0},
                        {"Material \"matte\" \"rgb Kd\" [.3 .3 .3] \"float sigma\" 10", 0.3f, 0},
                        {"Material \"plastic\"", 0.25f, 0},
                        {"Material \"uber\"", 0.25f, 0},
                        {"Material \"uber\" \"rgb opacity\" [0 0 0]", 0.25f, kTransmissive},
                        {"Material \"translucent\"", 0.25f, 0},
                        {"Material \"substrate\"", 0.5f, 0},
                        {"Material \"mirror\"", 0.9f, kMirror},
                        {"Material \"glass\"", 1.0f, kTransmissive},
                        {"Material \"none\"", 0.0f, kInvisible},
                        {"Material \"\"", 0.0f, kInvisible},
                        {"Material \"disney\" \"float metallic\" 1", 0.5f, kMetal},
                        {"Material \"disney\" \"float spectrans\" 1", 0.5f, kTransmissive},
                        {"Material \"kdsubsurface\"", 0.5f, 0}}) {
    const Imported imported = import_world(folder, std::string(c.text) + std::string(kTriangle));
    EXPECT_NEAR(material_of(imported).albedo.x, c.albedo, 1e-6f) << c.text;
    EXPECT_EQ(material_of(imported).flags, c.flags) << c.text;
    EXPECT_EQ(imported.text(), "") << c.text;
  }
}

TEST(Materials, MetalsReflectTheirColour) {
  const SceneFolder folder;
  const Material copper = material_of(import_world(folder, "Material \"metal\"" + std::string(kTriangle)));
  EXPECT_EQ(copper.flags, kMetal);
  EXPECT_GT(copper.albedo.x, copper.albedo.z);
  const Material gold = material_of(import_world(
      folder, "Material \"metal\" \"spectrum eta\" \"metals/Au.eta.spd\" \"spectrum k\" \"metals/Au.k.spd\"" +
                  std::string(kTriangle)));
  EXPECT_GT(gold.albedo.x, 2.0f * gold.albedo.z);
  const Material glassy = material_of(
      import_world(folder, "Material \"metal\" \"rgb eta\" [1.5 1.5 1.5] \"rgb k\" [0 0 0]" + std::string(kTriangle)));
  EXPECT_NEAR(glassy.albedo.x, 0.092f, 0.002f); // diffuse reflectance of glass from outside, index 1.5
}

TEST(Materials, MixesBlendColoursAndShareFlags) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder,
      "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [1 0 0] MakeNamedMaterial \"b\" \"string type\" "
      "\"glass\""
      "MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" "
      "\"rgb amount\" [0.25 0.25 0.25] NamedMaterial \"m\"" +
          std::string(kTriangle));
  const Material material = material_of(imported);
  EXPECT_EQ(material.name, "m");
  EXPECT_NEAR(material.albedo.x, 1.0f, 1e-6f);
  EXPECT_NEAR(material.albedo.y, 0.75f, 1e-6f);
  EXPECT_EQ(material.flags, 0u);
  EXPECT_EQ(imported.text(), "");
}

TEST(Materials, ShapeParametersOverrideTheMaterials) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Material \"matte\" \"rgb Kd\" [0.1 0.1 0.1]" + std::string(kTriangle) +
                               "\"rgb Kd\" [0.2 0.2 0.2]" + std::string(kTriangle));
  ASSERT_EQ(imported.scene.materials.size(), 2u);
  EXPECT_NEAR(imported.scene.materials[imported.scene.shapes[0].material].albedo.x, 0.2f, 1e-6f);
  EXPECT_NEAR(imported.scene.materials[imported.scene.shapes[1].material].albedo.x, 0.1f, 1e-6f);
  EXPECT_EQ(imported.text(), "");
}

TEST(Materials, EqualOnesAreStoredOnce) {
  const SceneFolder folder;
  std::string text;
  for (int i = 0; i < 50; ++i) text += "Material \"matte\" \"rgb Kd\" [0.1 0.1 0.1]" + std::string(kTriangle);
  EXPECT_EQ(import_world(folder, text).scene.materials.size(), 1u);
}

TEST(Materials, UnknownNamesAreReportedWithAHint) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "MakeNamedMaterial \"Chrome\" \"string type\" \"mirror\" NamedMaterial \"Chrme\" Material \"mate\"" +
                  std::string(kTriangle));
  EXPECT_TRUE(
      imported.reported("error: no named material \"Chrme\"; the material before it stays; did you mean \"Chrome\"?"));
  EXPECT_TRUE(imported.reported("error: unknown material \"mate\"; matte is used; did you mean \"matte\"?"));
}

TEST(Materials, NamedOnesEndWithTheirBlock) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "AttributeBegin MakeNamedMaterial \"m\" \"string type\" \"mirror\" AttributeEnd NamedMaterial \"m\"" +
                  std::string(kTriangle));
  EXPECT_EQ(material_of(imported).flags, 0u);
  EXPECT_TRUE(imported.reported("no named material \"m\""));
}

TEST(Materials, ColoursAreClampedAloud) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Material \"matte\" \"rgb Kd\" [2 -1 nan]" + std::string(kTriangle) +
                               "Material \"plastic\" \"rgb Kd\" [2 -1 0.5]" + std::string(kTriangle));
  ASSERT_EQ(imported.scene.materials.size(), 2u);
  EXPECT_EQ(imported.scene.materials[0].albedo, Vec3(0.5f));
  EXPECT_EQ(imported.scene.materials[1].albedo, Vec3(1, 0, 0.5f));
  EXPECT_TRUE(imported.reported("error: parameter \"rgb Kd\" is not finite"));
  EXPECT_TRUE(imported.reported("note: material \"plastic\": its colour leaves [0, 1] and is clamped"));
}

TEST(Lights, AreaLightsMarkTheirShapes) {
  const SceneFolder folder;
  struct Case {
    const char* text;
    MaterialFlags flags;
  };
  for (const Case& c : {Case{"AreaLightSource \"diffuse\"", kEmissive},
                        {"AreaLightSource \"area\" \"color L\" [2 2 2] \"integer nsamples\" 4", kEmissive},
                        {"AreaLightSource \"diffuse\" \"bool twosided\" \"true\"", kEmissive | kEmitsBothSides},
                        {"AreaLightSource \"diffuse\" \"rgb L\" [0 0 0]", 0},
                        {"AreaLightSource \"diffuse\" \"blackbody L\" [3000 5]", kEmissive},
                        {"AttributeBegin AreaLightSource \"diffuse\" AttributeEnd", 0}}) {
    const Imported imported = import_world(folder, std::string(c.text) + std::string(kTriangle));
    EXPECT_EQ(material_of(imported).flags, c.flags) << c.text;
    EXPECT_EQ(imported.text(), "") << c.text;
  }
  EXPECT_TRUE(import_world(folder, "AreaLightSource \"sphere\"").reported("unknown area light \"sphere\""));
}

// Cameras

TEST(Cameras, PerspectiveWithFilm) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "LookAt 1 2 3  1 2 8  0 1 0 Camera \"perspective\" \"float fov\" 40 \"float lensradius\" 1 "
              "Film \"image\" \"integer xresolution\" 320 \"integer yresolution\" 200 \"string filename\" \"a.exr\" "
              "WorldBegin WorldEnd");
  ASSERT_EQ(imported.scene.cameras.size(), 1u);
  const Camera& camera = imported.scene.cameras[0];
  EXPECT_EQ(camera.fov_degrees, 40.0);
  EXPECT_EQ(camera.width_px, 320u);
  EXPECT_EQ(camera.height_px, 200u);
  EXPECT_EQ(camera.film_name, "a.exr");
  EXPECT_FALSE(camera.screen_window);
  const DVec3 ahead = transform_point(camera.world_from_camera, DVec3(0, 0, 1));
  EXPECT_NEAR(ahead.x, 1, 1e-12);
  EXPECT_NEAR(ahead.y, 2, 1e-12);
  EXPECT_NEAR(ahead.z, 4, 1e-12);
  EXPECT_EQ(imported.text(), "");
}

TEST(Cameras, LastOneComesFirst) {
  const SceneFolder folder;
  const Imported imported =
      import_text(folder, "Film \"image\" \"integer xresolution\" 11 Camera \"perspective\" Camera \"orthographic\" "
                          "\"float screenwindow\" [-2 2 -1 1] "
                          "Film \"image\" \"integer xresolution\" 22 Camera \"environment\" WorldBegin WorldEnd");
  ASSERT_EQ(imported.scene.cameras.size(), 3u);
  EXPECT_EQ(imported.scene.cameras[0].projection, Projection::kEnvironment);
  EXPECT_EQ(imported.scene.cameras[0].width_px, 22u);
  EXPECT_EQ(imported.scene.cameras[1].projection, Projection::kPerspective);
  EXPECT_EQ(imported.scene.cameras[2].projection, Projection::kOrthographic);
  EXPECT_EQ(imported.scene.cameras[2].width_px, 22u);
  EXPECT_EQ(imported.scene.cameras[2].screen_window, glm::dvec4(-2, 2, -1, 1));
}

TEST(Cameras, FilmBeforeTheCameraCounts) {
  const SceneFolder folder;
  const Imported imported =
      import_text(folder, "Film \"image\" \"integer xresolution\" 11 Camera \"perspective\" WorldBegin WorldEnd");
  EXPECT_EQ(imported.scene.cameras[0].width_px, 11u);
  EXPECT_EQ(imported.scene.cameras[0].height_px, 480u); // pbrt's default
}

TEST(Cameras, FrameAspectRatioSetsTheScreen) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Camera \"perspective\" \"float frameaspectratio\" 0.5 \"float halffov\" 20 WorldBegin WorldEnd");
  EXPECT_EQ(imported.scene.cameras[0].screen_window, glm::dvec4(-1, 1, -2, 2));
  EXPECT_EQ(imported.scene.cameras[0].fov_degrees, 40.0);
}

TEST(Cameras, BadValuesAreReported) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Scale 1 0 1 Camera \"perspective\" Identity Camera \"perspective\" \"float fov\" 200 "
              "Film \"image\" \"integer xresolution\" -5 \"integer yresolution\" 2000000000 Camera \"fisheye\" "
              "WorldBegin WorldEnd");
  ASSERT_EQ(imported.scene.cameras.size(), 1u);
  EXPECT_EQ(imported.scene.cameras[0].fov_degrees, 90.0);
  EXPECT_EQ(imported.scene.cameras[0].width_px, 640u);
  EXPECT_TRUE(imported.reported("the camera's transform has no inverse"));
  EXPECT_TRUE(imported.reported("xresolution must lie between 1 and 65536; 640 is used"));
  EXPECT_TRUE(imported.reported("unknown camera \"fisheye\""));
}

// Whole imports

TEST(ImportScene, StrictModeFailsAfterReportingEverything) {
  const SceneFolder folder;
  const auto file = folder.write("scene.pbrt", "WorldBegin\nShape \"spere\"\nNonsense\nWorldEnd");
  ImportOptions options;
  options.strict = true;
  Diagnostics diagnostics;
  Progress progress;
  try {
    import_scene(file, options, diagnostics, progress);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("scene.pbrt:2:1: Shape \"spere\""), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("(2 problems in all"), std::string::npos);
  }
  EXPECT_EQ(diagnostics.count(Severity::kError), 2u);
}

TEST(ImportScene, EveryTruncationOfASceneIsSurvived) {
  const SceneFolder folder;
  folder.write("a.ply", kPly);
  const std::string text = "Camera \"perspective\" WorldBegin Texture \"t\" \"float\" \"constant\" \"float value\" "
                           "0.5\nAttributeBegin Material "
                           "\"matte\" \"rgb Kd\" [1 0 0] " +
                           ply_shape("a.ply") + "ObjectBegin \"o\"" + std::string(kTriangle) +
                           "\"texture alpha\" \"t\" ObjectEnd AttributeEnd ObjectInstance \"o\" WorldEnd";
  for (size_t size = 0; size < text.size(); ++size) {
    const Imported imported = import_text(folder, text.substr(0, size));
    EXPECT_FALSE(imported.diagnostics.empty()) << size;
    EXPECT_LE(placed_triangle_count(imported.scene), 2u);
  }
  EXPECT_EQ(import_text(folder, text).text(), "");
}

TEST(ImportScene, ByteFlipsAreSurvived) {
  const SceneFolder folder;
  const std::string text =
      "Camera \"perspective\" WorldBegin AttributeBegin Scale 2 2 2 Material \"matte\" \"rgb Kd\" [1 0 0] " +
      std::string(kTriangle) + "AttributeEnd ObjectBegin \"o\" Shape \"disk\" ObjectEnd ObjectInstance \"o\" WorldEnd";
  for (size_t i = 0; i < text.size(); ++i)
    for (const int bit : {0, 4, 7}) {
      std::string flipped = text;
      flipped[i] = static_cast<char>(flipped[i] ^ (1 << bit));
      const Imported imported = import_text(folder, flipped);
      for (const Shape& shape : imported.scene.shapes) ASSERT_LT(shape.mesh, imported.scene.meshes.size());
    }
}

std::optional<std::filesystem::path> real_scenes() {
  const char* const folder = std::getenv("PACKTRACE_SCENES");
  return folder ? std::optional<std::filesystem::path>(folder) : std::nullopt;
}

TEST(RealScenes, HouseLosesOnlyItsMissingFile) {
  if (!real_scenes()) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
  const Imported imported = import_file(*real_scenes() / "house/scene.pbrt");
  EXPECT_EQ(imported.statistics.triangles, 1'571'178u);
  EXPECT_EQ(imported.count(Severity::kError), 1u) << imported.text();
  EXPECT_TRUE(imported.reported("Mesh121.ply\": no such file"));
  EXPECT_EQ(imported.statistics.textures_found, 2u);
}

TEST(RealScenes, SpaceshipLosesOnlyItsMissingFile) {
  if (!real_scenes()) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
  const Imported imported = import_file(*real_scenes() / "spaceship/scene.pbrt");
  EXPECT_EQ(imported.statistics.triangles, 318'558u);
  EXPECT_EQ(imported.count(Severity::kError), 1u) << imported.text();
  EXPECT_TRUE(imported.reported("Mesh066.ply\": no such file"));
}

TEST(RealScenes, KillerooIsSubdividedAndLit) {
  if (!real_scenes()) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
  const Imported imported = import_file(*real_scenes() / "killeroo/killeroo-simple.pbrt");
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.shapes.size(), 5u);
  uint64_t subdivided = 0;
  for (const Mesh& mesh : imported.scene.meshes)
    if (mesh.name.starts_with("loopsubdiv")) subdivided += mesh.triangles.size();
  EXPECT_EQ(subdivided, 66'528u);
  EXPECT_EQ(imported.statistics.area_lights, 1u);
  EXPECT_EQ(imported.scene.cameras[0].width_px, 700u);
}

TEST(RealScenes, VolumetricCausticHasItsFlags) {
  if (!real_scenes()) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
  const Imported imported = import_file(*real_scenes() / "volumetric-caustic/scene.pbrt");
  EXPECT_EQ(imported.text(), "");
  const auto flags_of = [&](std::string_view name) {
    for (const Material& material : imported.scene.materials)
      if (material.name == name) return material.flags;
    return ~0u;
  };
  EXPECT_EQ(flags_of("FrontWall"), kInvisible);
  EXPECT_EQ(flags_of("Sphere"), kTransmissive);
  EXPECT_EQ(flags_of("Light"), kEmissive);
}

} // namespace
} // namespace packtrace
