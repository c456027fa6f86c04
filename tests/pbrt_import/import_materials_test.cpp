#include "pbrt_import/import_scene.h"

#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

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
    EXPECT_NEAR(only_material(imported).albedo.x, c.albedo, 1e-6f) << c.text;
    EXPECT_EQ(only_material(imported).flags, c.flags) << c.text;
    EXPECT_EQ(imported.text(), "") << c.text;
  }
}

TEST(Materials, MetalsReflectTheirColour) {
  const SceneFolder folder;
  const Material copper = only_material(import_world(folder, "Material \"metal\"" + std::string(kTriangle)));
  EXPECT_EQ(copper.flags, kMetal);
  EXPECT_GT(copper.albedo.x, copper.albedo.z);
  const Material gold = only_material(import_world(
      folder, "Material \"metal\" \"spectrum eta\" \"metals/Au.eta.spd\" \"spectrum k\" \"metals/Au.k.spd\"" +
                  std::string(kTriangle)));
  EXPECT_GT(gold.albedo.x, 2.0f * gold.albedo.z);
  const Material glassy = only_material(
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
  const Material material = only_material(imported);
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
  EXPECT_EQ(only_material(imported).flags, 0u);
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
    EXPECT_EQ(only_material(imported).flags, c.flags) << c.text;
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

} // namespace
} // namespace packtrace
