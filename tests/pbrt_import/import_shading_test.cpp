// Materials and lights of ImportOptions::keep_shading.

#include <cmath>

#include "pbrt_import/import_scene.h"
#include "pbrt_import/language/shading_recipe.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/pbrt_import/texture_images.h"

namespace packtrace {
namespace {

ImportOptions with_shading() {
  ImportOptions options;
  options.keep_shading = true;
  return options;
}

Imported import_shaded(const SceneFolder& folder, const std::string& world) {
  return import_text(folder, "WorldBegin " + world + "\nWorldEnd\n", with_shading());
}

Imported import_shaded_material(const SceneFolder& folder, const std::string& material) {
  return import_shaded(folder, material + std::string(kTriangle));
}

SurfaceShading shading_of(const SceneFolder& folder, const std::string& material) {
  const Imported imported = import_shaded_material(folder, material);
  return only_material(imported).shading;
}

Light only_light(const SceneFolder& folder, const std::string& light) {
  const Imported imported = import_shaded(folder, light + std::string(kTriangle));
  EXPECT_EQ(imported.text(), "") << light;
  EXPECT_EQ(imported.scene.lights.size(), 1u) << light;
  return imported.scene.lights.empty() ? Light{} : imported.scene.lights[0];
}

void expect_near(Vec3 a, Vec3 b, float tolerance = 1e-5f) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << "component " << c;
}

TEST(ShadedMaterials, AreOnlyReadOnRequest) {
  const SceneFolder folder;
  const Imported plain = import_text(folder, "WorldBegin LightSource \"point\" Material \"mirror\"" +
                                                 std::string(kTriangle) + " WorldEnd");
  EXPECT_FALSE(plain.scene.has_shading);
  EXPECT_TRUE(plain.scene.lights.empty());
  EXPECT_EQ(only_material(plain).shading, SurfaceShading{});
  EXPECT_EQ(plain.statistics.ignored.at("light_sources"), 1u);
  const Imported shaded = import_shaded(folder, "LightSource \"point\" Material \"mirror\"" + std::string(kTriangle));
  EXPECT_TRUE(shaded.scene.has_shading);
  EXPECT_EQ(shaded.scene.lights.size(), 1u);
  EXPECT_FALSE(shaded.statistics.ignored.contains("light_sources"));
}

TEST(ShadedMaterials, MatteKeepsSigma) {
  const SceneFolder folder;
  EXPECT_EQ(shading_of(folder, "Material \"matte\""), SurfaceShading{});
  EXPECT_FLOAT_EQ(shading_of(folder, "Material \"matte\" \"float sigma\" 20").sigma, 20.0f);
}

TEST(ShadedMaterials, PlasticHasADielectricCoat) {
  const SceneFolder folder;
  const SurfaceShading plastic = shading_of(folder, "Material \"plastic\" \"rgb Ks\" [.1 .2 .3]");
  EXPECT_EQ(plastic.bits, kFresnelDielectric);
  expect_near(plastic.specular, {0.1f, 0.2f, 0.3f});
  EXPECT_FLOAT_EQ(plastic.eta, 1.5f);
  EXPECT_FLOAT_EQ(plastic.diffuse, 1.0f);
  EXPECT_FLOAT_EQ(plastic.roughness, alpha_of_roughness(0.1f));
  const SurfaceShading raw =
      shading_of(folder, "Material \"plastic\" \"float roughness\" .3 \"bool remaproughness\" \"false\"");
  EXPECT_FLOAT_EQ(raw.roughness, 0.3f);
}

TEST(ShadedMaterials, RoughnessIsRemappedAsInPbrt) {
  EXPECT_NEAR(alpha_of_roughness(1.0f), 1.62142f, 1e-6f);
  const double x = std::log(0.1);
  EXPECT_NEAR(alpha_of_roughness(0.1f),
              1.62142 + 0.819955 * x + 0.1734 * x * x + 0.0171201 * x * x * x + 0.000640711 * x * x * x * x, 1e-5);
}

TEST(ShadedMaterials, MirrorsAndGlassAreSmooth) {
  const SceneFolder folder;
  const SurfaceShading mirror = shading_of(folder, "Material \"mirror\" \"rgb Kr\" [.5 .6 .7]");
  EXPECT_EQ(mirror.bits, kFresnelNone | kSpecularTimesAlbedo);
  expect_near(mirror.specular, Vec3(1.0f));
  EXPECT_FLOAT_EQ(mirror.diffuse, 0.0f);
  EXPECT_FLOAT_EQ(mirror.roughness, 0.0f);
  const SurfaceShading glass = shading_of(folder, "Material \"glass\" \"float index\" 1.7 \"rgb Kt\" [.9 .8 .7]");
  EXPECT_EQ(glass.bits, kFresnelDielectric);
  EXPECT_FLOAT_EQ(glass.eta, 1.7f);
  expect_near(glass.transmission, {0.9f, 0.8f, 0.7f});
  expect_near(glass.specular, Vec3(1.0f));
}

TEST(ShadedMaterials, MetalsHaveTheirIndices) {
  const SceneFolder folder;
  const SurfaceShading metal =
      shading_of(folder, "Material \"metal\" \"rgb eta\" [.2 .9 1.1] \"rgb k\" [3 2 1] \"float uroughness\" .1 "
                         "\"float vroughness\" .4 \"bool remaproughness\" \"false\"");
  EXPECT_EQ(metal.bits, kFresnelConductor);
  expect_near(metal.metal_eta, {0.2f, 0.9f, 1.1f});
  expect_near(metal.metal_k, {3.0f, 2.0f, 1.0f});
  EXPECT_FLOAT_EQ(metal.roughness, 0.2f);
}

TEST(ShadedMaterials, UberIsGlossyMirroringOrThin) {
  const SceneFolder folder;
  const SurfaceShading glossy = shading_of(folder, "Material \"uber\" \"rgb Ks\" [.3 .3 .3] \"float eta\" 1.6");
  expect_near(glossy.specular, Vec3(0.3f));
  EXPECT_FLOAT_EQ(glossy.eta, 1.6f);
  EXPECT_GT(glossy.roughness, 0.0f);
  const SurfaceShading mirroring = shading_of(folder, "Material \"uber\" \"rgb Kr\" [.4 .4 .4]");
  expect_near(mirroring.specular, Vec3(0.4f));
  EXPECT_FLOAT_EQ(mirroring.roughness, 0.0f);
  const SurfaceShading thin = shading_of(folder, "Material \"uber\" \"rgb opacity\" [.25 .25 .25] \"rgb Ks\" [0 0 0]");
  EXPECT_EQ(thin.bits & kThin, kThin);
  expect_near(thin.transmission, Vec3(0.75f));
  EXPECT_FLOAT_EQ(thin.diffuse, 0.25f);
}

TEST(ShadedMaterials, DisneyIsMetalOrDielectric) {
  const SceneFolder folder;
  const SurfaceShading metal = shading_of(folder, "Material \"disney\" \"float metallic\" 1 \"float roughness\" .3");
  EXPECT_EQ(metal.bits, kFresnelSchlick | kSpecularTimesAlbedo);
  EXPECT_FLOAT_EQ(metal.diffuse, 0.0f);
  EXPECT_NEAR(metal.roughness, 0.09f, 1e-6f);
  const SurfaceShading plain = shading_of(folder, "Material \"disney\"");
  EXPECT_EQ(plain.bits, kFresnelDielectric);
  EXPECT_FLOAT_EQ(plain.diffuse, 1.0f);
}

TEST(ShadedMaterials, MixesBlendTheirParts) {
  const SceneFolder folder;
  const SurfaceShading mix = shading_of(
      folder, "MakeNamedMaterial \"a\" \"string type\" \"matte\" MakeNamedMaterial \"b\" \"string type\" \"mirror\" "
              "MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string namedmaterial1\" \"a\" \"string "
              "namedmaterial2\" \"b\" \"rgb amount\" [.25 .25 .25] NamedMaterial \"m\"");
  EXPECT_FLOAT_EQ(mix.diffuse, 0.25f);
  expect_near(mix.specular, Vec3(0.75f));
  EXPECT_EQ(mix.bits & kSpecularTimesAlbedo, kSpecularTimesAlbedo);
}

TEST(ShadedMaterials, SayOnceWhatTheyLeaveOut) {
  const SceneFolder folder;
  const std::string twice = std::string(kTriangle) + "\"rgb Kd\" [.1 .1 .1]" + std::string(kTriangle);
  for (const auto& [material, words] : std::initializer_list<std::pair<const char*, const char*>>{
           {"Material \"fourier\" \"string bsdffile\" \"x\"", "table is not read"},
           {"Material \"hair\"", "fibres"},
           {"Material \"translucent\"", "transmits"},
           {"Material \"subsurface\"", "scatter"},
           {"Material \"disney\" \"float sheen\" 1", "\"sheen\" is left out"},
           {"Material \"uber\" \"rgb Kr\" [1 1 1]", "\"Ks\" is left out"},
           {"Material \"metal\" \"float uroughness\" .1 \"float vroughness\" .2", "geometric mean"}}) {
    const Imported imported = import_shaded(folder, material + twice);
    EXPECT_TRUE(imported.reported("is simplified: ")) << material;
    EXPECT_TRUE(imported.reported(words)) << material << imported.text();
    EXPECT_EQ(imported.count(Severity::kNote), 1u) << material << imported.text();
    EXPECT_EQ(imported.diagnostics[0].location.line, 1u);
  }
}

TEST(ShadedMaterials, SayOnceThatBumpMapsAreNotUsed) {
  const SceneFolder folder;
  const std::string bumpy = "Material \"matte\" \"texture bumpmap\" \"b\"" + std::string(kTriangle);
  const std::string world = "Texture \"b\" \"float\" \"constant\" " + bumpy + "\n" + bumpy;
  const Imported shaded = import_shaded(folder, world);
  uint64_t lines = 0;
  for (const Diagnostic& diagnostic : shaded.diagnostics)
    lines += diagnostic.message.find("bump and normal maps are not used") != std::string::npos;
  EXPECT_EQ(lines, 1u) << shaded.text();
  EXPECT_FALSE(import_text(folder, "WorldBegin " + world + " WorldEnd").reported("bump and normal maps"));
}

TEST(ShadedMaterials, ValuesOutOfRangeAreReported) {
  const SceneFolder folder;
  for (const auto& [material, words] : std::initializer_list<std::pair<const char*, const char*>>{
           {"Material \"glass\" \"float eta\" .2", "index of refraction"},
           {"Material \"plastic\" \"rgb Ks\" [2 0 0]", "specular reflection"},
           {"Material \"plastic\" \"rgb Ks\" [-2 0 0]", "specular reflection"},
           {"Material \"matte\" \"float sigma\" 1000", "\"sigma\""},
           {"Material \"plastic\" \"float roughness\" -1", "roughness"}}) {
    const Imported imported = import_shaded_material(folder, material);
    EXPECT_EQ(imported.count(Severity::kWarning), 1u) << imported.text();
    EXPECT_TRUE(imported.reported(words)) << material << imported.text();
    const SurfaceShading& shading = only_material(imported).shading;
    EXPECT_TRUE(shading.eta >= 1.0f && shading.specular.x >= 0.0f && shading.specular.x <= 1.0f &&
                shading.sigma <= 90.0f && shading.roughness >= 0.0f);
  }
}

TEST(ShadedMaterials, TexturedRoughnessCountsAsItsAverage) {
  const SceneFolder folder;
  folder.write("a.pfm", pfm(2, 1, {0.1f, 0.1f, 0.1f, 0.3f, 0.3f, 0.3f}));
  const Imported imported = import_shaded_material(
      folder, "Texture \"r\" \"float\" \"imagemap\" \"string filename\" \"a.pfm\" Material \"plastic\" "
              "\"texture roughness\" \"r\" \"bool remaproughness\" \"false\"");
  EXPECT_NEAR(only_material(imported).shading.roughness, 0.2f, 1e-6f);
  EXPECT_TRUE(imported.reported("average of a texture"));
}

TEST(ShadedMaterials, AreaLightsEmitTheirRadiance) {
  const SceneFolder folder;
  const Imported imported =
      import_shaded(folder, "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"rgb scale\" [2 2 2]" +
                                std::string(kTriangle) +
                                "AttributeEnd AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 5 5] " +
                                std::string(kTriangle) + "AttributeEnd" + std::string(kTriangle));
  ASSERT_EQ(imported.scene.shapes.size(), 3u);
  const auto emission = [&](size_t shape) {
    return imported.scene.materials[imported.scene.shapes[shape].material].shading.emission;
  };
  expect_near(emission(0), {2.0f, 4.0f, 6.0f});
  expect_near(emission(1), Vec3(5.0f));
  expect_near(emission(2), Vec3(0.0f));
}

TEST(ShadedMaterials, OuterSideIsThatOfTheVertexNormals) {
  const SceneFolder folder;
  const auto triangle = [](const char* normal) {
    const std::string n(normal);
    return "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [" + n +
           " " + n + " " + n + "]";
  };
  const std::string light = "AreaLightSource \"diffuse\" ";
  const Imported along = import_shaded(folder, light + triangle("0 0 1"));
  EXPECT_EQ(only_material(along).shading.bits & kOuterSideOpposite, 0u);
  const Imported against = import_shaded(folder, light + triangle("0 0 -1"));
  const Material& material = against.scene.materials[against.scene.shapes[0].material];
  EXPECT_EQ(material.shading.bits & kOuterSideOpposite, kOuterSideOpposite);
  const Imported matte = import_shaded(folder, triangle("0 0 -1"));
  EXPECT_EQ(only_material(matte).shading.bits, 0u);
}

// Lights

TEST(Lights, PointLightsStandAtFrom) {
  const SceneFolder folder;
  const Light light = only_light(
      folder,
      "Translate 1 2 3 LightSource \"point\" \"rgb I\" [1 2 4] \"rgb scale\" [.5 .5 .5] \"point from\" [1 0 0]");
  EXPECT_EQ(light.kind, LightKind::kPoint);
  expect_near(Vec3(light.position), {2.0f, 2.0f, 3.0f});
  expect_near(light.radiance, {0.5f, 1.0f, 2.0f});
}

TEST(Lights, SpotLightsHaveACone) {
  const SceneFolder folder;
  const Light light = only_light(folder, "LightSource \"spot\" \"float coneangle\" 40 \"float conedeltaangle\" 10 "
                                         "\"point from\" [0 0 1] \"point to\" [0 3 1]");
  EXPECT_EQ(light.kind, LightKind::kSpot);
  expect_near(light.direction, {0.0f, 1.0f, 0.0f});
  EXPECT_NEAR(light.cos_outer, std::cos(40.0 * 3.14159265358979 / 180.0), 1e-6);
  EXPECT_NEAR(light.cos_inner, std::cos(30.0 * 3.14159265358979 / 180.0), 1e-6);
}

TEST(Lights, DistantLightsPointBackToThemselves) {
  const SceneFolder folder;
  const Light light = only_light(
      folder,
      "Rotate 90 0 0 1 LightSource \"distant\" \"blackbody L\" [6500 2] \"point from\" [1 0 0] \"point to\" [0 0 0]");
  EXPECT_EQ(light.kind, LightKind::kDistant);
  expect_near(light.direction, {0.0f, 1.0f, 0.0f});
  EXPECT_GT(light.radiance.x, 0.5f);
}

TEST(Lights, InfiniteLightsKeepTheirMap) {
  const SceneFolder folder;
  folder.write("sky.pfm", pfm(2, 2, {1, 0, 0, 2, 0, 0, 0, 0, 500, 0, 0, 4})); // rows from the bottom
  const Imported imported = import_shaded(
      folder, "Rotate 90 1 0 0 LightSource \"infinite\" \"string mapname\" \"sky.pfm\" \"rgb L\" [2 2 2]" +
                  std::string(kTriangle));
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.environment_maps.size(), 1u);
  const EnvironmentMap& map = imported.scene.environment_maps[0];
  EXPECT_EQ(map.width, 2u);
  EXPECT_EQ(map.height, 2u);
  EXPECT_FLOAT_EQ(map.radiance[0].z, 500.0f);
  EXPECT_FLOAT_EQ(map.radiance[2].x, 1.0f);
  const Light& light = imported.scene.lights[0];
  EXPECT_EQ(light.map, 0u);
  expect_near(light.world_from_light * Vec3(0.0f, 1.0f, 0.0f), {0.0f, 0.0f, 1.0f});
  expect_near(light.radiance, Vec3(2.0f));
}

TEST(Lights, LargeMapsAreAveraged) {
  const SceneFolder folder;
  constexpr uint32_t kWidth = 2 * kMaxMapWidth;
  std::vector<float> pixels(size_t{kWidth} * 3);
  for (uint32_t x = 0; x < kWidth; ++x) pixels[3 * x] = static_cast<float>(x);
  folder.write("sky.pfm", pfm(kWidth, 1, pixels));
  const Imported imported =
      import_shaded(folder, "LightSource \"infinite\" \"string mapname\" \"sky.pfm\"" + std::string(kTriangle));
  ASSERT_EQ(imported.scene.environment_maps.size(), 1u);
  const EnvironmentMap& map = imported.scene.environment_maps[0];
  ASSERT_EQ(map.width, kMaxMapWidth);
  EXPECT_EQ(map.height, 1u);
  for (uint32_t x = 0; x < map.width; ++x) ASSERT_FLOAT_EQ(map.radiance[x].x, 2.0f * static_cast<float>(x) + 0.5f);
}

TEST(Lights, BadOnesAreReportedAndLeftOut) {
  const SceneFolder folder;
  for (const auto& [light, words] : std::initializer_list<std::pair<const char*, const char*>>{
           {"LightSource \"pont\"", "did you mean \"point\"?"},
           {"LightSource \"distant\" \"point from\" [1 1 1] \"point to\" [1 1 1]", "no place or no direction"},
           {"Scale 1 1 0 LightSource \"infinite\"", "no inverse"},
           {"LightSource \"point\" \"rgb I\" [1e38 1 1] \"rgb scale\" [1e38 1 1]", "out of range"}}) {
    const Imported imported = import_shaded(folder, light + std::string("\nIdentity\n") + std::string(kTriangle));
    EXPECT_EQ(imported.count(Severity::kError), 1u) << imported.text();
    EXPECT_TRUE(imported.reported(words)) << imported.text();
    EXPECT_TRUE(imported.scene.lights.empty()) << light;
  }
}

TEST(Lights, BadParametersAreReportedAndDefaultsUsed) {
  const SceneFolder folder;
  for (const auto& [light, words] : std::initializer_list<std::pair<const char*, const char*>>{
           {"LightSource \"spot\" \"float coneangle\" 400", "within 0 and 180"},
           {"LightSource \"point\" \"point fom\" [1 2 3]", "fom"},
           {"LightSource \"point\" \"rgb I\" [-1 1 1]", "negative"},
           {"LightSource \"spot\" \"float coneangle\" 10 \"float conedeltaangle\" 20", "falls off from its axis"},
           {"LightSource \"projection\" \"string mapname\" \"x.png\"", "shines evenly as a spot"},
           {"LightSource \"infinite\" \"string mapname\" \"missing.pfm\"", "missing.pfm"}}) {
    const Imported imported = import_shaded(folder, light + std::string(kTriangle));
    EXPECT_TRUE(imported.reported(words)) << imported.text();
    EXPECT_EQ(imported.scene.lights.size(), 1u) << light;
    EXPECT_TRUE(is_finite(imported.scene.lights[0].radiance));
    EXPECT_TRUE(imported.scene.environment_maps.empty());
    EXPECT_EQ(imported.scene.lights[0].map, kNoMap);
  }
}

TEST(Lights, MoveWithAFarWorld) {
  const SceneFolder folder;
  const Imported imported =
      import_shaded(folder, "Translate 1e9 0 0 LightSource \"point\" \"point from\" [1 2 3]" + std::string(kTriangle));
  EXPECT_NE(imported.scene.origin.x, 0.0);
  EXPECT_NEAR(imported.scene.lights[0].position.x + imported.scene.origin.x, 1e9 + 1.0, 1e-6);
}

} // namespace
} // namespace packtrace
