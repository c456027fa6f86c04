#include "pbrt_import/import_scene.h"

#include <cstdlib>
#include <optional>

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

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
  // The transform at ObjectBegin applies twice: pbrt multiplies instance and shape transforms.
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
  EXPECT_TRUE(imported.reported("warning: object \"a\" is never instanced"));
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
  EXPECT_EQ(only_material(imported).flags, 0u);
  EXPECT_TRUE(imported.reported("warning: area lights in objects do not emit"));
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
                              std::string(kTriangle) + "WorldBegin WorldBegin WorldEnd");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_TRUE(
      imported.reported("error: Shape belongs between WorldBegin and WorldEnd; it is ignored (2 times, first here)"));
  EXPECT_TRUE(imported.reported("error: Film belongs before WorldBegin; it is ignored"));
  EXPECT_TRUE(imported.reported("error: WorldBegin inside the world block"));
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
