// Files with several worlds, of which only one is read.
#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

ImportOptions world(uint32_t number) {
  ImportOptions options;
  options.world = number;
  return options;
}

/// Two worlds that differ in all their content.
std::string two_worlds() {
  return "Translate 0 0 1 CoordinateSystem \"mine\" Camera \"perspective\" \"float fov\" 30\n"
         "Film \"image\" \"integer xresolution\" 11\n"
         "WorldBegin MakeNamedMaterial \"m\" \"string type\" \"mirror\" Texture \"t\" \"float\" \"constant\"\n"
         "ObjectBegin \"o\"" +
         std::string(kTriangle) +
         "ObjectEnd NamedMaterial \"m\" Translate 5 0 0 ActiveTransform StartTime\n"
         "ObjectInstance \"o\" WorldEnd\n"
         "Camera \"orthographic\"\n"
         "WorldBegin" +
         std::string(kTriangle) + std::string(kTriangle) + "WorldEnd\n";
}

TEST(Worlds, TheFirstIsReadUnlessSaidOtherwise) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, two_worlds());
  EXPECT_EQ(imported.scene.instances.size(), 1u);
  EXPECT_TRUE(imported.scene.shapes.empty());
  ASSERT_EQ(imported.scene.cameras.size(), 1u);
  EXPECT_EQ(imported.scene.cameras[0].fov_degrees, 30.0);
  EXPECT_EQ(imported.scene.cameras[0].width_px, 11u);
  EXPECT_EQ(imported.statistics.worlds, 2u);
  EXPECT_TRUE(imported.reported("warning: the file has 2 worlds; only world 1 is read"));
  EXPECT_EQ(imported.diagnostics.size(), 1u) << imported.text();
}

TEST(Worlds, OneThatWasChosenIsNoCauseForAWarning) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, two_worlds(), world(1));
  EXPECT_TRUE(imported.reported("note: the file has 2 worlds; only world 1 is read")) << imported.text();
}

TEST(Worlds, EachStartsAfresh) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, two_worlds(), world(2));
  EXPECT_EQ(imported.diagnostics.size(), 1u) << imported.text();
  EXPECT_TRUE(imported.scene.instances.empty());
  ASSERT_EQ(imported.scene.shapes.size(), 2u);
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 0), DVec3(0.0));
  EXPECT_EQ(imported.scene.shapes[0].animation, kNotAnimated);
  EXPECT_EQ(only_material(imported).flags, 0u);
  ASSERT_EQ(imported.scene.cameras.size(), 1u);
  EXPECT_EQ(imported.scene.cameras[0].projection, Projection::kOrthographic);
  EXPECT_EQ(imported.scene.cameras[0].world_from_camera, DAffine(1.0));
  EXPECT_EQ(imported.scene.cameras[0].width_px, 1280u);
}

TEST(Worlds, NamesOfOneAreUnknownInTheNext) {
  const SceneFolder folder;
  const std::string uses = "Film \"image\" CoordSysTransform \"mine\" WorldBegin NamedMaterial \"m\" ObjectInstance "
                           "\"o\" CoordSysTransform \"camera\" WorldEnd";
  const Imported imported = import_text(folder, two_worlds() + uses, world(3));
  EXPECT_EQ(imported.count(Severity::kError), 4u) << imported.text();
  EXPECT_TRUE(imported.reported("no coordinate system \"mine\""));
  EXPECT_TRUE(imported.reported("no coordinate system \"camera\""));
  EXPECT_TRUE(imported.reported("no named material \"m\""));
  EXPECT_TRUE(imported.reported("no object \"o\""));
}

TEST(Worlds, OneThatDoesNotExistIsAnError) {
  const SceneFolder folder;
  try {
    import_text(folder, two_worlds(), world(3));
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("scene.pbrt: there is no world 3: the file has 2"), std::string::npos)
        << error.what();
  }
  EXPECT_THROW(import_text(folder, "", world(2)), Error);
  try {
    import_text(folder, two_worlds(), world(0));
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  }
}

TEST(Worlds, FilesOfUnreadOnesAreNotOpenedButTheirTextIsChecked) {
  const SceneFolder folder;
  const Imported imported =
      import_text(folder, "WorldBegin" + std::string(kTriangle) + "WorldEnd\nWorldBegin " + ply_shape("gone.ply") +
                              "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"gone.png\"\n"
                              "Trianslate 1 2 3\nTranslate 1 2\nWorldEnd");
  EXPECT_EQ(imported.statistics.shapes.size(), 1u); // shapes of other worlds are not counted
  EXPECT_EQ(imported.statistics.textures_missing, 0u);
  EXPECT_EQ(imported.count(Severity::kError), 2u) << imported.text();
  EXPECT_TRUE(imported.reported("4:1: error: unknown directive \"Trianslate\""));
  EXPECT_TRUE(imported.reported("5:1: error: Translate takes 3 numbers"));
}

TEST(Worlds, WorldDirectivesBetweenThemAreErrors) {
  const SceneFolder folder;
  const std::string between = "\nTexture \"t\" \"float\" \"constant\"\nIdentity\nMakeNamedMedium \"fog\"\n";
  for (const uint32_t number : {1u, 2u}) {
    const Imported imported =
        import_text(folder, "WorldBegin WorldEnd" + between + "WorldBegin WorldEnd", world(number));
    EXPECT_EQ(imported.count(Severity::kError), 1u) << imported.text();
    EXPECT_TRUE(imported.reported("2:1: error: Texture belongs between WorldBegin and WorldEnd"));
  }
}

TEST(Worlds, OptionsBehindTheLastOneAreReported) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, "WorldBegin WorldEnd\nFilm \"image\"\nIdentity");
  EXPECT_EQ(imported.count(Severity::kWarning), 1u) << imported.text();
  EXPECT_TRUE(imported.reported("2:1: warning: what follows the last WorldEnd has no effect"));
}

TEST(Worlds, EveryOneNeedsItsEnd) {
  const SceneFolder folder;
  for (const uint32_t number : {1u, 2u}) {
    const Imported imported = import_text(folder, "WorldBegin WorldEnd WorldBegin", world(number));
    EXPECT_EQ(imported.count(Severity::kWarning), 1u) << imported.text();
    EXPECT_TRUE(imported.reported("warning: the file ends without WorldEnd"));
  }
}

TEST(Worlds, BlocksLeftOpenInOneDoNotReachTheNext) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "WorldBegin AttributeBegin ObjectBegin \"o\" WorldEnd WorldBegin" + std::string(kTriangle) + "WorldEnd",
      world(2));
  EXPECT_EQ(imported.scene.shapes.size(), 1u) << imported.text();
}

} // namespace
} // namespace packtrace
