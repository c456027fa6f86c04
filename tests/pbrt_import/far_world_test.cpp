// Worlds that lie far from their zero are moved, with all digits that the text has.
#include <cstdio>

#include "pbrt_import/scene/far_world.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

constexpr double kAway[3] = {1.0, 0.25, -0.5};

std::string at(double distance, double x, double y, double z) {
  char text[100];
  std::snprintf(text, sizeof text, " %.17g %.17g %.17g ", distance * kAway[0] + x, distance * kAway[1] + y,
                distance * kAway[2] + z);
  return text;
}

/// A world of all kinds of placements, a few units wide, at a distance from zero.
std::string world_at(double distance) {
  const std::string triangle(kTriangle);
  return "LookAt" + at(distance, 1, 2, -9) + at(distance, 0, 0.3, 0.7) + "0 1 0 Camera \"perspective\" " +
         "ActiveTransform EndTime Translate 0 0 0.5 Camera \"perspective\" ActiveTransform All WorldBegin " +
         "ObjectBegin \"lost\" ObjectEnd ObjectBegin \"own\"" + triangle + "ObjectEnd AttributeBegin Translate" +
         at(distance, 0.3, 0.7, 1.9) + triangle + "ObjectInstance \"lost\" Rotate 30 1 2 3 ObjectInstance \"own\"" +
         "ActiveTransform EndTime Translate 0.1 0 0 ObjectInstance \"own\"" + triangle + "AttributeEnd " +
         "AttributeBegin Translate" + at(distance, -1.7, 0.9, 0.1) + "ObjectInstance \"own\" AttributeEnd " +
         // An object whose shapes lie far from its zero; the instance has the identity transform.
         "ObjectBegin \"there\" Translate" + at(distance, 0.6, 1.1, -0.4) + triangle +
         "Identity ObjectEnd ObjectInstance \"there\" WorldEnd";
}

Scene import_at(double distance) {
  const SceneFolder folder;
  return import_text(folder, world_at(distance)).scene;
}

void expect_near(const DAffine& actual, const DAffine& expected, DVec3 by, double tolerance, const std::string& what) {
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      EXPECT_NEAR(actual[column][row], expected[column][row] + (column == 3 ? by[row] : 0.0), tolerance)
          << what << ", column " << column << " row " << row;
}

/// world_from_mesh of the first shape of an instance's object.
DAffine placed(const Scene& scene, size_t instance) {
  const Instance& i = scene.instances[instance];
  return compose(DAffine(i.world_from_object), scene.objects[i.object].shapes[0].parent_from_mesh);
}

void expect_moved(double distance) {
  const Scene near = import_at(0.0), far = import_at(distance);
  EXPECT_EQ(near.origin, DVec3(0.0));
  const DVec3 away = DVec3(kAway[0], kAway[1], kAway[2]) * distance;
  EXPECT_LT(glm::length(far.origin - away), 10.0);
  // Rounding errors of the numbers in the text, and of floats near zero.
  const double rounding = 4.0 * 0x1p-52 * distance, floats = rounding + 4e-6;
  const DVec3 by = away - far.origin;
  ASSERT_EQ(far.shapes.size(), near.shapes.size());
  ASSERT_EQ(far.instances.size(), near.instances.size());
  ASSERT_EQ(far.cameras.size(), 2u);
  for (size_t i = 0; i < near.shapes.size(); ++i) {
    expect_near(far.shapes[i].parent_from_mesh, near.shapes[i].parent_from_mesh, by, rounding, "shape");
    ASSERT_EQ(far.shapes[i].animation == kNotAnimated, near.shapes[i].animation == kNotAnimated);
    if (near.shapes[i].animation != kNotAnimated)
      expect_near(far.animations[far.shapes[i].animation].end.map, near.animations[near.shapes[i].animation].end.map,
                  by, rounding, "animated shape");
  }
  for (size_t i = 0; i < near.instances.size(); ++i)
    expect_near(placed(far, i), placed(near, i), by, floats, "instance");
  for (size_t i = 0; i < near.cameras.size(); ++i)
    expect_near(far.cameras[i].world_from_camera, near.cameras[i].world_from_camera, by, 4.0 * rounding, "camera");
  ASSERT_EQ(far.animated_instances.size(), 1u);
  expect_near(far.animations[far.animated_instances[0].animation].end.map,
              near.animations[near.animated_instances[0].animation].end.map, by, rounding, "animated instance");
  EXPECT_EQ(far.animations.size(), near.animations.size());
}

TEST(FarWorld, KeepsAllDigitsOfTheText) {
  for (const double distance : {1e6, 1e7, 1e9}) {
    SCOPED_TRACE(distance);
    expect_moved(distance);
  }
}

TEST(FarWorld, StaysWhereFloatsAreFine) {
  for (const double distance : {0.0, 10.0, 300.0}) {
    const Scene scene = import_at(distance);
    EXPECT_EQ(scene.origin, DVec3(0.0));
    EXPECT_DOUBLE_EQ(scene.shapes[0].parent_from_mesh[3].x, distance * kAway[0] + 0.3);
  }
}

TEST(FarWorld, ZeroThatTheSceneSpansStays) {
  const SceneFolder folder;
  const Scene scene = import_text(folder, "WorldBegin" + std::string(kTriangle) + "Translate 1e9 0 0" +
                                              std::string(kTriangle) + "WorldEnd")
                          .scene;
  EXPECT_EQ(scene.origin, DVec3(0.0));
}

TEST(FarWorlds, CentresNearTheEndOfTheRangeStayFinite) {
  const SceneFolder folder;
  for (const char* const place : {"1e308 1 0", "1.79e308 -1.79e308 1.79e308", "-1.7e308 0 1e300"}) {
    const Scene scene = import_world(folder, std::string("Translate ") + place + std::string(kTriangle)).scene;
    ASSERT_EQ(scene.shapes.size(), 1u) << place;
    for (int column = 0; column < 4; ++column)
      EXPECT_TRUE(is_finite(scene.shapes[0].parent_from_mesh[column])) << place;
    EXPECT_TRUE(is_finite(scene.origin)) << place;
  }
}

} // namespace
} // namespace packtrace
