#include "tests/pbrt_import/hostile_scene.h"

namespace packtrace {
namespace {

// Colours of unusual materials

struct ColourCase {
  const char* text;
  Vec3 albedo;
  MaterialFlags flags;
};

void expect_colours(const std::vector<ColourCase>& cases) {
  const SceneFolder folder;
  const std::string start = "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [0.2 0.2 0.2] "
                            "MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0.8 0.8 0.8] "
                            "Texture \"zero\" \"spectrum\" \"constant\" \"rgb value\" [0 0 0] "
                            "Texture \"two\" \"spectrum\" \"constant\" \"rgb value\" [2 2 2] ";
  for (const ColourCase& c : cases) {
    const Imported imported = import_world(folder, start + c.text + std::string(kTriangle));
    const Material material = only_material(imported);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(material.albedo[i], c.albedo[i], 1e-6f) << c.text;
    EXPECT_EQ(material.flags, c.flags) << c.text;
    EXPECT_EQ(imported.text(), "") << c.text;
  }
}

TEST(HostileColours, GlassThatTransmitsNothingIsOpaque) {
  expect_colours(
      {{"Material \"glass\" \"rgb Kt\" [0 0 0]", Vec3(1.0f), 0},
       {"Material \"glass\" \"rgb Kt\" [0 0 0] \"rgb Kr\" [0.1 0.2 0.3]", Vec3(0.1f, 0.2f, 0.3f), 0},
       {"Material \"glass\" \"texture Kt\" \"zero\" \"rgb Kr\" [0.1 0.2 0.3]", Vec3(0.1f, 0.2f, 0.3f), 0},
       {"Material \"glass\" \"rgb Kt\" [0 0 0] \"rgb Kr\" [0 0 0]", Vec3(0.0f), 0},
       {"Material \"glass\" \"rgb Kt\" [0 0.5 0] \"rgb Kr\" [0.1 0.2 0.3]", Vec3(0.0f, 0.5f, 0.0f), kTransmissive}});
}

TEST(HostileColours, AmountsOfMixesAreClamped) {
  const std::string mix = "Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" ";
  const std::string many = mix + "\"rgb amount\" [2 -1 0.5]", two = mix + "\"texture amount\" \"two\"",
                    most = mix + "\"rgb amount\" [1e38 1e38 1e38]", negative = mix + "\"rgb amount\" [-1 -1 -1]";
  expect_colours({{many.c_str(), Vec3(0.2f, 0.8f, 0.5f), 0},
                  {two.c_str(), Vec3(0.2f), 0},
                  {most.c_str(), Vec3(0.2f), 0},
                  {negative.c_str(), Vec3(0.8f), 0}});
}

TEST(HostileColours, MetalsOfTexturesAreCopper) {
  const SceneFolder folder;
  const auto albedo = [&](const std::string& parameters) {
    return only_material(import_world(folder, "Texture \"n\" \"spectrum\" \"fbm\" Material \"metal\" " + parameters +
                                                  std::string(kTriangle)))
        .albedo;
  };
  EXPECT_EQ(albedo("\"texture eta\" \"n\" \"texture k\" \"n\""), albedo(""));
  EXPECT_EQ(albedo("\"texture eta\" \"n\" \"rgb k\" [3 3 3]"), albedo("\"rgb k\" [3 3 3]"));
}

// Equal quadrics

TEST(HostileQuadrics, EqualOnesShareAMesh) {
  const SceneFolder folder;
  const auto meshes = [&](const std::string& shapes) {
    const Imported imported = import_world(folder, shapes);
    EXPECT_EQ(imported.text(), "") << shapes;
    expect_sound(imported.scene);
    return imported.scene.meshes.size();
  };
  for (const char* const kind : {"sphere", "cylinder", "disk", "cone", "paraboloid"}) {
    const std::string shape = "Shape \"" + std::string(kind) + "\" ", two = "\"float radius\" 2 ";
    EXPECT_EQ(meshes(shape + shape + shape + "\"float radius\" 1 "), 1u) << kind;
    EXPECT_EQ(meshes(shape + "\"float phimax\" 90 " + shape + "\"float phimax\" 91 "), 2u) << kind;
    EXPECT_EQ(meshes(shape + shape + two + shape + two), kind == std::string("sphere") ? 1u : 2u) << kind;
  }
  const std::string cut = "\"float zmax\" 0.5 ";
  EXPECT_EQ(meshes("Shape \"sphere\" " + cut + "Shape \"sphere\" \"float radius\" 2 " + cut), 2u);
  EXPECT_EQ(meshes("Shape \"hyperboloid\" Shape \"hyperboloid\" Shape \"hyperboloid\" \"point p1\" [1 1 0] "), 2u);
}

TEST(HostileQuadrics, WholeSpheresAreScaledToTheirSize) {
  const SceneFolder folder;
  for (const char* const text : {"3", "1e-20", "1e18", "3 \"float zmin\" -9 \"float zmax\" 9"}) {
    const Imported imported =
        import_world(folder, "Translate 1 0 0 Shape \"sphere\" \"float radius\" " + std::string(text));
    EXPECT_EQ(imported.text(), "");
    ASSERT_EQ(imported.scene.shapes.size(), 1u) << text;
    const double radius = std::stod(text);
    const Mesh& mesh = imported.scene.meshes[0];
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      EXPECT_NEAR(glm::length(DVec3(mesh.positions[i])), 1.0, 1e-6);
      const DVec3 centred =
          imported.scene.origin + placed(imported.scene.shapes[0], imported.scene, i) - DVec3(1, 0, 0);
      ASSERT_NEAR(glm::length(centred), radius, 1e-6 * std::max(radius, 1.0)) << text;
    }
  }
}

} // namespace
} // namespace packtrace
