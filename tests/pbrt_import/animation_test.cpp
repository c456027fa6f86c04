#include <limits>
#include <numbers>

#include "pbrt_import/base/error.h"
#include "pbrt_import/language/transforms.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

void expect_near(const DAffine& actual, const DAffine& expected, double tolerance) {
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      EXPECT_NEAR(actual[column][row], expected[column][row], tolerance) << "column " << column << " row " << row;
}

DAffine turned(double degrees) { return *rotation(degrees, {1, 2, 3}); }

DAffine middle(const DAffine& start, const DAffine& end) {
  const std::optional<AnimatedTransform> keys = animate(start, end, {});
  EXPECT_TRUE(keys);
  return keys ? interpolate(*keys, 0.5) : DAffine(0.0);
}

// Decomposition of maps

TEST(Decomposition, PartsMakeTheMapAgain) {
  const DAffine sheared(DVec3(1, 0.2, 0), DVec3(-0.7, 3, 0.5), DVec3(0, 0.1, 0.4), DVec3(9, 8, 7));
  for (const double size : {1e-30, 1.0, 1e30})
    for (const DAffine& shape : {sheared, compose(scaling({1, 1, -1}), sheared), turned(170), scaling({-1, -1, -1})}) {
      const DAffine map = compose(scaling(DVec3(size)), shape);
      const std::optional<TransformKey> key = decompose(map);
      ASSERT_TRUE(key);
      const glm::dmat3 rotated = glm::mat3_cast(key->rotation);
      EXPECT_NEAR(glm::determinant(rotated), 1.0, 1e-12);
      const glm::dmat3 linear = rotated * key->scale;
      expect_near(DAffine(linear[0], linear[1], linear[2], map[3]), map, 1e-13 * 4 * size);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < i; ++j) EXPECT_NEAR(key->scale[i][j], key->scale[j][i], 1e-13 * size);
      EXPECT_EQ(glm::determinant(key->scale) < 0.0, swaps_handedness(map));
    }
}

TEST(Decomposition, ScaleIsThatAlongTheAxesOfTheObject) {
  const std::optional<TransformKey> key = decompose(compose(turned(50), scaling({2, 3, 4})));
  ASSERT_TRUE(key);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(key->scale[i][j], i == j ? 2.0 + i : 0.0, 1e-13);
}

TEST(Decomposition, FlatMapsHaveNone) {
  EXPECT_FALSE(decompose(scaling({1, 0, 1})));
  EXPECT_FALSE(decompose(scaling({1, std::numeric_limits<double>::infinity(), 1})));
  EXPECT_FALSE(decompose(DAffine(DVec3(1, 1, 0), DVec3(1, 1, 0), DVec3(0, 0, 1), DVec3(0))));
}

// Interpolation between keys

TEST(Interpolation, EndPointsAreTheGivenMapsAndTimesOutsideAreClamped) {
  const DAffine start = compose(translation({1, 2, 3}), compose(turned(20), scaling({1, 0.3, 7})));
  const DAffine end = compose(turned(130), scaling({-2, 1, 1}));
  const AnimatedTransform keys = *animate(start, end, {2.0, 6.0});
  for (const double time : {2.0, 1.999, -1e30}) EXPECT_EQ(interpolate(keys, time), start) << time;
  for (const double time : {6.0, 6.001, 1e30}) EXPECT_EQ(interpolate(keys, time), end) << time;
  EXPECT_NE(interpolate(keys, 3.0), start);
  EXPECT_NE(interpolate(keys, 5.0), end);
}

TEST(Interpolation, KeysAtOneTimeDoNotDivideByZero) {
  const AnimatedTransform keys = *animate(DAffine(1.0), turned(30), {1.0, 1.0});
  EXPECT_EQ(interpolate(keys, 1.0), DAffine(1.0));
  EXPECT_EQ(interpolate(keys, 1.5), turned(30));
}

TEST(Interpolation, RotationAtTheMiddleIsTheHalfAngle) {
  for (const double degrees : {1e-4, 10.0, 90.0, 179.0})
    expect_near(middle(DAffine(1.0), turned(degrees)), turned(degrees / 2), 1e-12);
  expect_near(middle(turned(40), turned(100)), turned(70), 1e-12);
  const AnimatedTransform keys = *animate(DAffine(1.0), turned(120), {0.0, 4.0});
  expect_near(interpolate(keys, 1.0), turned(30), 1e-12);
}

TEST(Interpolation, RotationTakesTheShorterWay) {
  // A rotation by 350 degrees equals one by -10: quaternions of opposite signs are the same rotation.
  expect_near(middle(DAffine(1.0), turned(350)), turned(-5), 1e-12);
  expect_near(middle(turned(100), turned(-100)), turned(180), 1e-12);
  const AnimatedTransform keys = *animate(turned(170), turned(190), {});
  EXPECT_GE(glm::dot(keys.start.rotation, keys.end.rotation), 0.0);
  expect_near(interpolate(keys, 0.5), turned(180), 1e-12);
  // Of these two the quaternions with the largest component positive are in opposite hemispheres.
  const AnimatedTransform apart = *animate(turned(10), turned(220), {});
  EXPECT_GE(glm::dot(apart.start.rotation, apart.end.rotation), 0.0);
  expect_near(interpolate(apart, 0.5), turned(-65), 1e-12);
}

TEST(Interpolation, TranslationAndScaleAreBlendedLinearly) {
  const DAffine start = scaling({1, 2, 3});
  const DAffine end = compose(translation({8, 0, -4}), scaling({3, 2, 1}));
  const AnimatedTransform keys = *animate(start, end, {});
  expect_near(interpolate(keys, 0.25), compose(translation({2, 0, -1}), scaling({1.5, 2, 2.5})), 1e-14);
}

TEST(Interpolation, MirroredThingsStayMirroredAllTheWay) {
  const DAffine mirror = scaling({1, 1, -1});
  const AnimatedTransform keys = *animate(mirror, compose(turned(80), mirror), {});
  for (double time = 0.0; time <= 1.0; time += 0.125) {
    const DAffine map = interpolate(keys, time);
    EXPECT_NEAR(glm::determinant(glm::dmat3(map)), -1.0, 1e-12) << time;
    expect_near(map, compose(turned(80 * time), mirror), 1e-12);
  }
}

TEST(Interpolation, MirroringOnTheWayPassesThroughASingularMap) {
  EXPECT_FALSE(is_invertible(middle(DAffine(1.0), scaling({-1, -1, -1}))));
}

TEST(Interpolation, FlatKeysHaveNoMotion) {
  EXPECT_FALSE(animate(scaling({1, 0, 1}), DAffine(1.0), {}));
  EXPECT_FALSE(animate(DAffine(1.0), scaling({1, 0, 1}), {}));
}

// Animated scenes

constexpr std::string_view kMoveBy8 = " ActiveTransform EndTime Translate 8 0 0 ActiveTransform All ";

ImportOptions at_time(double time) {
  ImportOptions options;
  options.time = time;
  return options;
}

std::string moving_shape() { return std::string(kMoveBy8) + std::string(kTriangle); }

TEST(AnimatedScenes, ThingsStandWhereTheyAreAsTheShutterOpens) {
  const SceneFolder folder;
  const Imported start = import_world(folder, moving_shape());
  EXPECT_EQ(placed(start.scene.shapes[0], start.scene, 0), DVec3(0, 0, 0));
  EXPECT_EQ(start.scene.time, 0.0);
  EXPECT_TRUE(start.reported("note: animated shape: it stands as at time 0"));
  const Imported open =
      import_text(folder, "Camera \"perspective\" \"float shutteropen\" 0.25 WorldBegin" + moving_shape() + "WorldEnd");
  EXPECT_EQ(placed(open.scene.shapes[0], open.scene, 0), DVec3(2, 0, 0));
  EXPECT_EQ(open.scene.time, 0.25);
}

TEST(AnimatedScenes, TimeAndTransformTimesDecide) {
  const SceneFolder folder;
  const auto x_at = [&](double time) {
    const Imported imported =
        import_text(folder, "TransformTimes 10 14 WorldBegin" + moving_shape() + "WorldEnd", at_time(time));
    return placed(imported.scene.shapes[0], imported.scene, 0).x;
  };
  EXPECT_EQ(x_at(9), 0.0);
  EXPECT_EQ(x_at(11), 2.0);
  EXPECT_EQ(x_at(14), 8.0);
  EXPECT_EQ(x_at(99), 8.0);
}

TEST(AnimatedScenes, KeysAreKeptWithTheirTimes) {
  const SceneFolder folder;
  const Imported imported =
      import_text(folder, "TransformTimes 10 14 WorldBegin" + moving_shape() + std::string(kTriangle) + "Identity" +
                              std::string(kTriangle) + "WorldEnd");
  ASSERT_EQ(imported.scene.animations.size(), 1u); // both shapes share one animation
  EXPECT_EQ(imported.scene.shapes[0].animation, 0u);
  EXPECT_EQ(imported.scene.shapes[1].animation, 0u);
  EXPECT_EQ(imported.scene.shapes[2].animation, kNotAnimated);
  const AnimatedTransform& keys = imported.scene.animations[0];
  EXPECT_EQ(keys.start_time, 10.0);
  EXPECT_EQ(keys.end_time, 14.0);
  EXPECT_EQ(keys.end.map, translation({8, 0, 0}));
  EXPECT_EQ(imported.statistics.animated_shapes, 2u);
}

TEST(AnimatedScenes, ShapesInObjectsMoveInTheObject) {
  const SceneFolder folder;
  const Imported imported =
      import_world(folder, "ObjectBegin \"o\"" + moving_shape() + "ObjectEnd ObjectInstance \"o\" ObjectInstance \"o\"",
                   at_time(0.5));
  ASSERT_EQ(imported.scene.objects.size(), 1u);
  EXPECT_EQ(placed(imported.scene.objects[0].shapes[0], imported.scene, 0), DVec3(4, 0, 0));
  EXPECT_EQ(imported.scene.instances[0].world_from_object, Affine(1.0f));
  EXPECT_EQ(imported.statistics.animated_shapes, 1u);
  EXPECT_EQ(imported.statistics.animated_instances, 0u);
}

TEST(AnimatedScenes, InstancesKeepTheirKeysWhenOthersAreLeftOut) {
  const SceneFolder folder;
  const std::string lost = "ObjectBegin \"lost\" " + ply_shape("gone.ply") + " ObjectEnd ";
  const std::string empty = "ObjectBegin \"empty\" ObjectEnd ";
  const std::string a = "ObjectBegin \"a\"" + std::string(kTriangle) + "ObjectEnd ";
  const std::string b = "ObjectBegin \"b\"" + std::string(kTriangle) + ply_shape("gone.ply") + "ObjectEnd ";
  const auto moving = [](const std::string& name, int x) {
    return "AttributeBegin ActiveTransform EndTime Translate " + std::to_string(x) + " 0 0 ObjectInstance \"" + name +
           "\" AttributeEnd ";
  };
  const Imported imported = import_world(folder,
                                         empty + a + lost + b + moving("empty", 1) + moving("lost", 2) +
                                             "ObjectInstance \"lost\" " + "ObjectInstance \"b\" " + moving("b", 30) +
                                             moving("a", 40) + "ObjectInstance \"a\" " + moving("a", 50),
                                         at_time(0.5));
  const Scene& scene = imported.scene;
  ASSERT_EQ(scene.instances.size(), 5u) << imported.text();
  ASSERT_EQ(scene.animated_instances.size(), 3u);
  ASSERT_EQ(scene.animations.size(), 3u); // only those of the remaining instances
  const uint32_t instances[] = {1, 2, 4};
  const float moved[] = {30, 40, 50};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(scene.animated_instances[i].instance, instances[i]);
    const AnimatedTransform& keys = scene.animations[scene.animated_instances[i].animation];
    EXPECT_EQ(keys.end.map[3].x, static_cast<double>(moved[i]));
    EXPECT_EQ(scene.instances[instances[i]].world_from_object[3].x, moved[i] / 2);
  }
  EXPECT_EQ(scene.instances[0].world_from_object, Affine(1.0f));
  EXPECT_EQ(imported.statistics.animated_instances, 3u);
}

TEST(AnimatedScenes, CamerasMove) {
  const SceneFolder folder;
  // The current transform is camera_from_world, whereas world_from_camera is animated.
  const std::string text = "Translate 0 0 -3" + std::string(kMoveBy8) +
                           "Camera \"perspective\" Identity Camera \"orthographic\" WorldBegin WorldEnd";
  const Imported imported = import_text(folder, text, at_time(0.25));
  ASSERT_EQ(imported.scene.cameras.size(), 2u);
  EXPECT_EQ(imported.scene.cameras[0].animation, kNotAnimated);
  EXPECT_EQ(imported.scene.cameras[1].animation, 0u);
  EXPECT_EQ(imported.scene.cameras[1].world_from_camera[3], DVec3(-2, 0, 3));
  ASSERT_EQ(imported.scene.animations.size(), 1u);
  EXPECT_EQ(imported.scene.animations[0].end.map[3], DVec3(-8, 0, 3));
  EXPECT_EQ(imported.statistics.animated_cameras, 1u);
}

TEST(AnimatedScenes, FlatKeysAreReportedAndDoNotMove) {
  const SceneFolder folder;
  const std::string flat_end = "ActiveTransform EndTime Scale 1 0 1 ActiveTransform All";
  const std::string flat_start = "ActiveTransform StartTime Scale 1 0 1 ActiveTransform All";
  const Imported end = import_world(folder, "Translate 1 0 0 " + flat_end + std::string(kTriangle), at_time(1));
  ASSERT_EQ(end.scene.shapes.size(), 1u);
  EXPECT_EQ(placed(end.scene.shapes[0], end.scene, 0), DVec3(1, 0, 0));
  EXPECT_TRUE(end.scene.animations.empty());
  EXPECT_TRUE(end.reported("error: animated shape: its transform at EndTime has no inverse")) << end.text();
  const Imported start = import_world(folder, flat_start + std::string(kTriangle), at_time(1));
  EXPECT_TRUE(start.scene.shapes.empty());
  EXPECT_EQ(start.count(Severity::kError), 1u) << start.text();
  const Imported camera = import_text(folder, flat_end + " Camera \"perspective\" WorldBegin WorldEnd");
  EXPECT_EQ(camera.scene.cameras.size(), 1u);
  EXPECT_TRUE(camera.reported("error: animated camera: its transform at EndTime has no inverse")) << camera.text();
}

TEST(AnimatedScenes, ThingsThatAreFlatAtTheTimeAreLeftOut) {
  const SceneFolder folder;
  const std::string turned_over = "ActiveTransform EndTime Scale -1 -1 -1 ActiveTransform All" + std::string(kTriangle);
  const Imported imported = import_world(folder, turned_over, at_time(0.5));
  EXPECT_TRUE(imported.scene.shapes.empty());
  EXPECT_TRUE(imported.reported("error: the shape's transform has no inverse"));
  EXPECT_EQ(import_world(folder, turned_over, at_time(0.75)).scene.shapes.size(), 1u);
}

TEST(AnimatedScenes, AreaLightsDoNotEmitFromThem) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "AreaLightSource \"diffuse\"" + moving_shape());
  EXPECT_EQ(only_material(imported).flags, 0u);
  EXPECT_TRUE(imported.reported("warning: area lights on animated shapes do not emit"));
}

TEST(AnimatedScenes, BadTimesAreReported) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "TransformTimes nan 1 Camera \"perspective\" \"float shutteropen\" 5 \"float shutterclose\" 2 "
              "WorldBegin TransformTimes 0 1" +
                  moving_shape() + "WorldEnd");
  EXPECT_TRUE(imported.reported("error: TransformTimes is ignored: a number is not finite")) << imported.text();
  EXPECT_TRUE(imported.reported("warning: the shutter closes before it opens"));
  EXPECT_TRUE(imported.reported("error: TransformTimes belongs before WorldBegin"));
  EXPECT_EQ(imported.scene.time, 2.0);
  EXPECT_TRUE(
      import_text(folder, "TransformTimes 2 1 WorldBegin WorldEnd").reported("warning: TransformTimes end before"));
  EXPECT_THROW(import_world(folder, "", at_time(std::numeric_limits<double>::quiet_NaN())), Error);
}

TEST(AnimatedScenes, WhatStandsStillCostsNothing) {
  static_assert(sizeof(Instance) == sizeof(uint32_t) + sizeof(Affine));
  static_assert(sizeof(Shape) == 4 * sizeof(uint32_t) + sizeof(DAffine));
  const SceneFolder folder;
  // Both transforms change equally, so nothing is animated.
  const Imported imported = import_world(
      folder, "ActiveTransform StartTime Translate 1 0 0 ActiveTransform EndTime Translate 1 0 0 ActiveTransform All" +
                  std::string(kTriangle) + "ObjectBegin \"o\"" + std::string(kTriangle) +
                  "ObjectEnd ObjectInstance \"o\"");
  EXPECT_TRUE(imported.scene.animations.empty());
  EXPECT_TRUE(imported.scene.animated_instances.empty());
  EXPECT_EQ(imported.text(), "");
}

} // namespace
} // namespace packtrace
