// Scoping rules of pbrt-v3's graphics state: what blocks save and restore, and what is global.
#include "pbrt_import/language/transforms.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

const std::string kShape(kTriangle);

const Material& material_of(const Imported& imported, size_t shape) {
  return imported.scene.materials[imported.scene.shapes[shape].material];
}

/// Position of a shape's first vertex in its parent's space.
DVec3 corner(const Imported& imported, size_t shape) { return placed(imported.scene.shapes[shape], imported.scene, 0); }

TEST(StateRules, AttributeBlocksScopeMaterialLightAndOrientation) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "AttributeBegin Material \"mirror\" AreaLightSource \"diffuse\" ReverseOrientation" +
                               kShape + "AttributeEnd" + kShape);
  EXPECT_EQ(material_of(imported, 0).flags, kMirror | kEmissive);
  EXPECT_EQ(material_of(imported, 1).flags, 0u);
  EXPECT_TRUE(imported.scene.shapes[0].reverse_orientation);
  EXPECT_FALSE(imported.scene.shapes[1].reverse_orientation);
}

TEST(StateRules, TransformBlocksScopeTransformsOnly) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "TransformBegin Material \"mirror\" ReverseOrientation MakeNamedMaterial \"m\" \"string type\" \"glass\" "
              "Translate 1 0 0 TransformEnd" +
                  kShape + "NamedMaterial \"m\"" + kShape);
  EXPECT_EQ(corner(imported, 0), DVec3(0.0));
  EXPECT_EQ(material_of(imported, 0).flags, kMirror);
  EXPECT_TRUE(imported.scene.shapes[0].reverse_orientation);
  EXPECT_EQ(material_of(imported, 1).flags, kTransmissive);
  EXPECT_EQ(imported.text(), "");
}

TEST(StateRules, NamedMaterialsAndTexturesEndWithTheirBlock) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "MakeNamedMaterial \"m\" \"string type\" \"matte\" \"rgb Kd\" [.1 .1 .1]\n"
                           "Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [.2 .2 .2]\n"
                           "AttributeBegin MakeNamedMaterial \"m\" \"string type\" \"matte\" \"rgb Kd\" [.3 .3 .3]\n"
                           "Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [.4 .4 .4]\n"
                           "Texture \"inner\" \"spectrum\" \"constant\" \"rgb value\" [.5 .5 .5] AttributeEnd\n"
                           "NamedMaterial \"m\"" +
                               kShape + "Material \"matte\" \"texture Kd\" \"t\"" + kShape +
                               "\nMaterial \"matte\" \"texture Kd\" \"inner\"");
  EXPECT_NEAR(material_of(imported, 0).albedo.x, 0.1f, 1e-6f);
  EXPECT_NEAR(material_of(imported, 1).albedo.x, 0.2f, 1e-6f);
  EXPECT_EQ(imported.count(Severity::kError), 1u) << imported.text();
  EXPECT_TRUE(imported.reported("\"inner\""));
}

TEST(StateRules, FloatAndSpectrumTexturesHaveNamesOfTheirOwn) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "Texture \"t\" \"float\" \"constant\" \"float value\" 0 Texture \"t\" \"spectrum\" \"constant\" \"rgb "
              "value\" [.25 .25 .25] Material \"matte\" \"texture Kd\" \"t\"" +
                  kShape + kShape + "\"texture alpha\" \"t\"");
  ASSERT_EQ(imported.scene.shapes.size(), 1u) << imported.text(); // the other shape's alpha is 0
  EXPECT_NEAR(material_of(imported, 0).albedo.x, 0.25f, 1e-6f);
}

TEST(StateRules, ActiveTransformsEndWithEitherBlock) {
  const SceneFolder folder;
  for (const std::string block : {"Attribute", "Transform"}) {
    const Imported imported =
        import_world(folder, block + "Begin ActiveTransform EndTime " + block + "End Translate 3 0 0" + kShape);
    EXPECT_EQ(corner(imported, 0), DVec3(3, 0, 0)) << block;
    EXPECT_EQ(imported.scene.shapes[0].animation, kNotAnimated) << block;
  }
}

TEST(StateRules, EveryTransformDirectiveMindsWhatIsActive) {
  const SceneFolder folder;
  for (const std::string directive :
       {"Identity", "Translate 9 9 9", "Scale 2 2 2", "Rotate 90 0 0 1", "LookAt 0 0 -5 0 0 0 0 1 0",
        "Transform [1 0 0 0 0 1 0 0 0 0 1 0 7 7 7 1]", "ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 7 7 7 1]"}) {
    const Imported imported =
        import_world(folder, "Translate 1 2 3 ActiveTransform EndTime " + directive + " ActiveTransform All" + kShape);
    ASSERT_EQ(imported.scene.animations.size(), 1u) << directive;
    EXPECT_EQ(imported.scene.animations[0].start.map, translation({1, 2, 3})) << directive;
    EXPECT_NE(imported.scene.animations[0].end.map, translation({1, 2, 3})) << directive;
  }
}

TEST(StateRules, CoordinateSystemsHoldBothTransformsWhateverIsActive) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "ActiveTransform EndTime Translate 4 0 0 ActiveTransform StartTime CoordinateSystem \"here\" "
              "ActiveTransform All Identity ActiveTransform StartTime CoordSysTransform \"here\"" +
                  kShape);
  ASSERT_EQ(imported.scene.animations.size(), 1u);
  EXPECT_EQ(imported.scene.animations[0].start.map, DAffine(1.0));
  EXPECT_EQ(imported.scene.animations[0].end.map, translation({4, 0, 0}));
}

TEST(StateRules, CoordinateSystemsObjectsAndMediaAreGlobal) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "AttributeBegin Translate 1 0 0 CoordinateSystem \"here\" MakeNamedMedium \"fog\" \"string type\" "
              "\"homogeneous\" ObjectBegin \"o\"" +
                  kShape + "ObjectEnd AttributeEnd CoordSysTransform \"here\" MediumInterface \"fog\" \"\"" + kShape +
                  "ObjectInstance \"o\"");
  EXPECT_EQ(corner(imported, 0), DVec3(1, 0, 0));
  EXPECT_EQ(imported.scene.instances.size(), 1u);
  EXPECT_EQ(imported.text(), "");
}

TEST(StateRules, MediaAreKnownByName) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, "MakeNamedMedium \"fog\"\nMakeNamedMedium \"smoke\"\nMediumInterface "
                                                "\"\" \"fog\"\nWorldBegin MediumInterface \"mist\"\nWorldEnd");
  EXPECT_EQ(imported.diagnostics.size(), 2u) << imported.text();
  EXPECT_TRUE(imported.reported("4:12: error: MediumInterface: no medium \"mist\""));
  EXPECT_TRUE(imported.reported("2:1: note: medium \"smoke\" is never used"));
  EXPECT_EQ(imported.statistics.ignored.at("media"), 2u);
  EXPECT_EQ(imported.statistics.ignored.at("medium_interfaces"), 2u);
}

TEST(StateRules, WorldBeginMakesBothTransformsTheIdentityAndActive) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Translate 5 0 0 ActiveTransform EndTime Translate 1 0 0 Identity WorldBegin Translate 0 2 0" + kShape +
                  "CoordSysTransform \"world\"" + kShape + "WorldEnd");
  EXPECT_EQ(corner(imported, 0), DVec3(0, 2, 0));
  EXPECT_EQ(corner(imported, 1), DVec3(0, 0, 0));
  EXPECT_TRUE(imported.scene.animations.empty());
}

TEST(StateRules, TransformsOutsideTheWorldMoveTheCamera) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Translate 1 0 0 Identity Translate 0 0 -2 ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 -3 0 1] "
              "CoordinateSystem \"before\" Camera \"perspective\" WorldBegin CoordSysTransform \"before\"" +
                  kShape + "WorldEnd");
  EXPECT_EQ(imported.scene.cameras[0].world_from_camera[3], DVec3(0, 3, 2));
  EXPECT_EQ(corner(imported, 0), DVec3(0, -3, -2));
}

TEST(StateRules, ObjectsScopeLikeAttributeBlocks) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "Translate 1 0 0 ObjectBegin \"o\" Material \"mirror\" ReverseOrientation Translate 5 5 5" +
                               kShape + "ObjectEnd" + kShape + "ObjectInstance \"o\"");
  EXPECT_EQ(corner(imported, 0), DVec3(1, 0, 0));
  EXPECT_EQ(material_of(imported, 0).flags, 0u);
  EXPECT_FALSE(imported.scene.shapes[0].reverse_orientation);
  const Shape& inside = imported.scene.objects[0].shapes[0];
  EXPECT_TRUE(inside.reverse_orientation);
  EXPECT_EQ(imported.scene.materials[inside.material].flags, kMirror);
  EXPECT_EQ(placed(inside, imported.scene, 0), DVec3(6, 5, 5)); // the transform is not reset
}

TEST(StateRules, ReverseOrientationTwiceIsNone) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "ReverseOrientation ReverseOrientation" + kShape);
  EXPECT_FALSE(imported.scene.shapes[0].reverse_orientation);
}

/// pbrt's rule for world-space triangles: cross(p0 - p2, p1 - p2), negated if the shape reverses its orientation or the
/// transform swaps handedness, but not both.
TEST(StateRules, NormalsFollowOrientationAndHandedness) {
  const SceneFolder folder;
  for (const std::string reverse : {"", "ReverseOrientation "})
    for (const std::string map : {"Rotate 40 1 2 3 ", "Scale 1 1 -1 Rotate 40 1 2 3 Scale 2 1 1 "}) {
      const Imported imported = import_world(folder, reverse + map + kShape);
      const Shape& shape = imported.scene.shapes[0];
      DVec3 p[3], q[3];
      for (size_t i = 0; i < 3; ++i) {
        p[i] = placed(shape, imported.scene, i);
        q[i] = DVec3(imported.scene.meshes[shape.mesh].positions[i]);
      }
      DVec3 pbrt = glm::normalize(glm::cross(p[0] - p[2], p[1] - p[2]));
      if (!reverse.empty() != (map.find('-') != std::string::npos)) pbrt = -pbrt;
      DVec3 ours = glm::normalize(normal_matrix(shape.parent_from_mesh) * glm::cross(q[1] - q[0], q[2] - q[0]));
      if (shape.reverse_orientation) ours = -ours;
      EXPECT_NEAR(glm::dot(pbrt, ours), 1.0, 1e-12) << reverse << map;
    }
}

TEST(StateRules, InstanceTransformsDoNotTurnNormalsOver) {
  const SceneFolder folder;
  // pbrt transforms an instance's normals by the inverse transpose, so mirroring does not flip the orientation.
  const Imported imported = import_world(folder, "ObjectBegin \"o\" ReverseOrientation" + kShape +
                                                     "ObjectEnd Scale 1 -1 1 ObjectInstance \"o\"");
  const Shape& shape = imported.scene.objects[0].shapes[0];
  EXPECT_TRUE(shape.reverse_orientation);
  EXPECT_FALSE(swaps_handedness(shape.parent_from_mesh));
  const DAffine world_from_object(imported.scene.instances[0].world_from_object);
  EXPECT_TRUE(swaps_handedness(world_from_object));
  EXPECT_GT((normal_matrix(world_from_object) * DVec3(0, 0, 1)).z, 0.0);
}

TEST(StateRules, ShapeParametersOverrideNamedMaterialsForOneShape) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, "MakeNamedMaterial \"m\" \"string type\" \"plastic\" \"rgb Kd\" [.1 .1 .1] NamedMaterial \"m\"" + kShape +
                  "\"rgb Kd\" [.6 .6 .6]" + kShape);
  EXPECT_NEAR(material_of(imported, 0).albedo.x, 0.6f, 1e-6f);
  EXPECT_NEAR(material_of(imported, 1).albedo.x, 0.1f, 1e-6f);
  EXPECT_EQ(imported.text(), "");
}

TEST(StateRules, WhatIsIgnoredIsCounted) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Integrator \"path\" Sampler \"halton\" Camera \"perspective\" \"float lensradius\" 1 WorldBegin "
              "LightSource \"infinite\" LightSource \"point\" Texture \"b\" \"float\" \"constant\" "
              "Material \"matte\" \"texture bumpmap\" \"b\"" +
                  kShape + "MakeNamedMaterial \"m\" \"string type\" \"matte\" Material \"\" WorldEnd");
  const std::map<std::string, uint64_t> expected = {
      {"render_settings", 2}, {"lenses", 1}, {"light_sources", 2}, {"bump_maps", 1}};
  EXPECT_EQ(imported.statistics.ignored, expected);
  const std::map<std::string, uint64_t> materials = {{"matte", 2}, {"none", 1}};
  EXPECT_EQ(imported.statistics.materials, materials);
}

} // namespace
} // namespace packtrace
