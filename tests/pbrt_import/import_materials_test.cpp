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
  EXPECT_NEAR(glassy.albedo.x, 0.092f, 0.002f); // diffuse reflectance of glass with index 1.5 from outside
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

} // namespace
} // namespace packtrace
