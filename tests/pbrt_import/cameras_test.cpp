#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

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
  EXPECT_EQ(imported.scene.cameras[0].height_px, 720u); // pbrt's default
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
  EXPECT_EQ(imported.scene.cameras[0].width_px, 1280u);
  EXPECT_TRUE(imported.reported("the camera's transform has no inverse"));
  EXPECT_TRUE(imported.reported("xresolution must lie between 1 and 65536; 1280 is used"));
  EXPECT_TRUE(imported.reported("unknown camera \"fisheye\""));
}

TEST(Cameras, ThoseBehindAnIgnoredTransformAreLeftOut) {
  const SceneFolder folder;
  for (const char* const ignored :
       {"Transform [1 0 0 0  0 1 0 0  0 0 1 .5  0 0 4 1]", "ConcatTransform [1 0 0 0  0 1 0 0  0 0 1 0  0 0 4 0]",
        "LookAt 0 0 1  0 0 1  0 1 0", "Rotate 90 0 0 0", "Translate nan 0 0", "Scale 1e400 1 1", "Translate 1 2",
        "Transform [1 0 0 0  0 1 0 0  0 0 1 0  0 0 4]", "CoordSysTransform \"nowhere\"", "LookAt"}) {
    const Imported imported = import_text(folder, std::string(ignored) + "\nCamera \"perspective\"\nWorldBegin" +
                                                      std::string(kTriangle) + "WorldEnd");
    EXPECT_TRUE(imported.scene.cameras.empty()) << ignored;
    EXPECT_EQ(imported.statistics.cameras_left_out, 1u) << ignored;
    EXPECT_TRUE(imported.reported("2:1: error: a transform before the camera is ignored")) << imported.text();
    EXPECT_EQ(imported.scene.shapes.size(), 1u); // WorldBegin resets the transform
    EXPECT_FALSE(imported.reported("may stand in a wrong place")) << imported.text();
  }
}

TEST(Cameras, TransformsThatStartAnewAreKnownAgain) {
  const SceneFolder folder;
  for (const char* const known :
       {"Identity", "Transform [1 0 0 0  0 1 0 0  0 0 1 0  0 0 4 1]", "CoordSysTransform \"before\""}) {
    const Imported imported = import_text(folder, "CoordinateSystem \"before\" Rotate 90 0 0 0 " + std::string(known) +
                                                      " Camera \"perspective\" WorldBegin WorldEnd");
    EXPECT_EQ(imported.scene.cameras.size(), 1u) << known;
    EXPECT_EQ(imported.statistics.cameras_left_out, 0u) << known;
  }
  // A coordinate system remembers that its transform is unknown.
  const Imported imported = import_text(folder, "Rotate 90 0 0 0 CoordinateSystem \"lost\" Identity CoordSysTransform "
                                                "\"lost\" Camera \"perspective\" WorldBegin WorldEnd");
  EXPECT_TRUE(imported.scene.cameras.empty());
}

TEST(Cameras, TheOthersStayWhereOneIsLeftOut) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, "Camera \"perspective\" \"float fov\" 30 Rotate 90 0 0 0 Camera "
                                                "\"perspective\" Camera \"fisheye\" Camera WorldBegin WorldEnd");
  ASSERT_EQ(imported.scene.cameras.size(), 1u);
  EXPECT_EQ(imported.scene.cameras[0].fov_degrees, 30.0);
  EXPECT_EQ(imported.statistics.cameras_left_out, 3u);
}

TEST(Cameras, ShapesBehindAnIgnoredTransformStayWithAWarning) {
  const SceneFolder folder;
  const Imported imported = import_world(folder, "\nAttributeBegin Rotate 1 0 0 0" + std::string(kTriangle) +
                                                     std::string(kTriangle) + "AttributeEnd" + std::string(kTriangle));
  EXPECT_EQ(imported.scene.shapes.size(), 3u);
  EXPECT_TRUE(
      imported.reported("2:31: warning: this shape may stand in a wrong place: a transform before it is ignored "
                        "(2 times, first here)"))
      << imported.text();
}

TEST(Cameras, ScreenWindowBeatsTheAspectRatio) {
  const SceneFolder folder;
  const Imported imported =
      import_text(folder, "Camera \"perspective\" \"float frameaspectratio\" 3 \"float screenwindow\" [-1 2 -3 4] "
                          "\"float fov\" 10 \"float halffov\" 30 WorldBegin WorldEnd");
  EXPECT_EQ(imported.scene.cameras[0].screen_window, glm::dvec4(-1, 2, -3, 4));
  EXPECT_EQ(imported.scene.cameras[0].fov_degrees, 60.0); // halffov takes precedence over fov
  EXPECT_EQ(imported.text(), "");
}

TEST(Cameras, WindowsThatMakeNoSenseAreReported) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Camera \"perspective\" \"float screenwindow\" [-1 2 -3] Camera \"perspective\" \"float "
              "frameaspectratio\" -1 Camera \"perspective\" \"float screenwindow\" [1 1 0 1] WorldBegin WorldEnd");
  for (const Camera& camera : imported.scene.cameras) EXPECT_FALSE(camera.screen_window);
  EXPECT_EQ(imported.count(Severity::kError), 3u) << imported.text();
  EXPECT_TRUE(imported.reported("error: frameaspectratio must be one positive number"));
}

TEST(Cameras, EnvironmentOnesSeeEverythingWhateverTheWindow) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Camera \"environment\" \"float screenwindow\" [-1 2 -3 4] \"float frameaspectratio\" 3 \"float "
              "lensradius\" 1\nFilm \"image\" \"float cropwindow\" [0 .5 0 .5] WorldBegin WorldEnd");
  EXPECT_FALSE(imported.scene.cameras[0].screen_window);
  EXPECT_EQ(imported.scene.cameras[0].width_px, 1280u);
  EXPECT_EQ(imported.diagnostics.size(), 1u) << imported.text();
  EXPECT_TRUE(imported.reported("2:1: note: the cropwindow of an environment camera is ignored"));
  EXPECT_EQ(imported.statistics.ignored.at("environment_crops"), 1u);
}

TEST(Cameras, LensesAndRealisticCamerasAreNotedOnce) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Camera \"perspective\" \"float lensradius\" 0 \"float focaldistance\" 3 Camera \"perspective\" \"float "
              "lensradius\" 1 Camera \"orthographic\" \"float lensradius\" 2 Camera \"realistic\" \"string lensfile\" "
              "\"x.dat\" WorldBegin WorldEnd");
  EXPECT_TRUE(imported.reported("note: the camera's lensradius is ignored: everything is in focus (2 times, first"))
      << imported.text();
  EXPECT_TRUE(imported.reported("warning: realistic cameras are not supported"));
  EXPECT_EQ(imported.statistics.ignored.at("lenses"), 2u);
  EXPECT_EQ(imported.statistics.ignored.at("realistic_cameras"), 1u);
}

TEST(Cameras, ShutterTimesAreKept) {
  const SceneFolder folder;
  const Imported imported = import_text(
      folder, "Camera \"perspective\" \"float shutteropen\" .25 \"float shutterclose\" .5 WorldBegin WorldEnd");
  EXPECT_EQ(imported.scene.cameras[0].shutter_open, 0.25);
  EXPECT_EQ(imported.scene.cameras[0].shutter_close, 0.5);
}

// Crop windows

Imported cropped(const SceneFolder& folder, const std::string& camera, const std::string& crop) {
  return import_text(folder, "Camera \"perspective\" " + camera +
                                 " Film \"image\" \"integer xresolution\" 10 \"integer yresolution\" 7 " + crop +
                                 " WorldBegin WorldEnd");
}

/// Centre of a pixel on the plane z = 1, in units of the screen window.
glm::dvec2 film_point(const Camera& camera, glm::dvec4 window, double column, double row) {
  return {window.x + (column + 0.5) / camera.width_px * (window.y - window.x),
          window.w + (row + 0.5) / camera.height_px * (window.z - window.w)};
}

TEST(CropWindow, PixelsAreThoseOfTheWholePicture) {
  const SceneFolder folder;
  const std::string crop = "\"float cropwindow\" [0.25 0.8 0.3 1]";
  for (const std::string window : {"", "\"float screenwindow\" [-3 1 -1 4]", "\"float frameaspectratio\" .5"}) {
    const Camera whole = cropped(folder, window, "").scene.cameras[0];
    const Camera part = cropped(folder, window, crop).scene.cameras[0];
    // Edges are rounded up: columns [ceil 2.5, ceil 8), rows [ceil 2.1, 7) from the top.
    ASSERT_EQ(part.width_px, 5u);
    ASSERT_EQ(part.height_px, 4u);
    ASSERT_TRUE(part.screen_window);
    EXPECT_EQ(part.fov_degrees, whole.fov_degrees);
    const glm::dvec4 whole_window = whole.screen_window.value_or(glm::dvec4(-10.0 / 7, 10.0 / 7, -1, 1));
    for (uint32_t row = 0; row < part.height_px; ++row)
      for (uint32_t column = 0; column < part.width_px; ++column) {
        const glm::dvec2 expected = film_point(whole, whole_window, column + 3, row + 3);
        const glm::dvec2 actual = film_point(part, *part.screen_window, column, row);
        EXPECT_NEAR(actual.x, expected.x, 1e-14);
        EXPECT_NEAR(actual.y, expected.y, 1e-14);
      }
  }
}

TEST(CropWindow, OrderAndExcessDoNotMatter) {
  const SceneFolder folder;
  const Camera straight = cropped(folder, "", "\"float cropwindow\" [0 .5 .5 1]").scene.cameras[0];
  const Camera swapped = cropped(folder, "", "\"float cropwindow\" [.5 -3 9 .5]").scene.cameras[0];
  EXPECT_EQ(swapped.screen_window, straight.screen_window);
  EXPECT_EQ(swapped.width_px, 5u);
  EXPECT_EQ(swapped.height_px, 3u);
  EXPECT_FALSE(cropped(folder, "", "\"float cropwindow\" [0 1 0 1]").scene.cameras[0].screen_window);
}

TEST(CropWindow, UnusableOnesAreReported) {
  const SceneFolder folder;
  for (const std::string values : {"[0 1 0]", "[.5 .5 0 1]", "[0 1 2 3]", "[0 nan 0 1]"}) {
    const Imported imported = cropped(folder, "", "\"float cropwindow\" " + values);
    EXPECT_EQ(imported.scene.cameras[0].width_px, 10u) << values;
    EXPECT_FALSE(imported.scene.cameras[0].screen_window) << values;
    EXPECT_EQ(imported.count(Severity::kError), 1u) << values << '\n' << imported.text();
    EXPECT_TRUE(imported.reported("cropwindow")) << values;
  }
}

} // namespace
} // namespace packtrace
