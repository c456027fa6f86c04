#include "runtime/view/view_controls.h"

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/runtime/view/view_bench.h"

namespace packtrace {
namespace {

using test::ViewBench;

class ControlsBench {
public:
  explicit ControlsBench(bool shading = false) : bench(shading) {}

  ViewBench bench;
  ViewSession session = bench.session();
  ViewControls controls{session};
  DVec3 position() const { return session.camera().camera().world_from_camera[3]; }
};

TEST(ViewControls, HeldKeysMoveTheCameraAtItsSpeed) {
  ControlsBench b;
  const DVec3 start = b.position();
  b.controls.press("w");
  EXPECT_TRUE(b.controls.busy());
  for (int i = 0; i < 10; ++i) b.controls.advance(0.1);
  const double gone = glm::length(b.position() - start);
  EXPECT_NEAR(gone, b.controls.speed(), 1e-6 * gone);
  b.controls.press("shift");
  b.controls.advance(1.0);
  EXPECT_NEAR(glm::length(b.position() - start), 5.0 * gone, 1e-5);
  b.controls.release("w");
  const DVec3 end = b.position();
  b.controls.advance(1.0);
  EXPECT_EQ(b.position(), end);
  b.controls.wheel(2);
  EXPECT_GT(b.controls.speed(), gone);
}

TEST(ViewControls, ViewKeysChooseLayers) {
  ControlsBench b;
  const auto layer_after = [&](const char* key) {
    EXPECT_EQ(b.controls.press(key), ViewRequest::kNone);
    return b.session.pane(0).layer;
  };
  EXPECT_EQ(layer_after("0"), "ground_truth");
  EXPECT_EQ(layer_after("1"), "ao_raw");
  EXPECT_EQ(layer_after("2"), "ao");
  EXPECT_EQ(layer_after("3"), "shaded");
  EXPECT_EQ(layer_after("enter"), "albedo");
  EXPECT_EQ(layer_after("enter"), "shaded");
  const size_t views = view_layer_names().size() - 9; // two need levels, three the packed tracer, four lights
  b.controls.press("2");
  for (size_t i = 0; i < views; ++i) b.controls.press("tab");
  EXPECT_EQ(b.session.pane(0).layer, "ao");
}

TEST(ViewControls, ScenesWithLightsAreShaded) {
  ControlsBench b(true);
  b.controls.press("3");
  EXPECT_EQ(b.session.pane(0).layer, "pbr+ao");
  b.controls.press("enter");
  EXPECT_EQ(b.session.pane(0).layer, "pbr");
  b.controls.press("enter");
  EXPECT_EQ(b.session.pane(0).layer, "pbr+ao");
}

TEST(ViewControls, LightsTurnUntilTheyArePaused) {
  ControlsBench b(true);
  b.controls.press("3");
  b.controls.press("l");
  EXPECT_TRUE(b.controls.busy());
  b.controls.advance(1.0);
  const float turned = b.session.pane(0).config.shade.light_turn;
  EXPECT_GT(turned, 0.0f);
  b.controls.press("space");
  EXPECT_FALSE(b.controls.busy());
  b.controls.advance(1.0);
  EXPECT_EQ(b.session.pane(0).config.shade.light_turn, turned);
  b.controls.press("space");
  for (int i = 0; i < 12; ++i) b.controls.advance(1.0);
  EXPECT_LT(b.session.pane(0).config.shade.light_turn, 360.0f) << "a full turn begins again";
}

TEST(ViewControls, KeysMoveThePickedObject) {
  ControlsBench b;
  EXPECT_THROW(b.controls.press("u"), Error) << "nothing is picked";
  test::step(b.session, 1);
  b.session.select(0, 24, 30);
  EXPECT_THROW(b.controls.press("u"), Error) << "the ground";
  EXPECT_FALSE(b.controls.busy());
  b.session.select(0, 24, 16);
  const DVec3 start(0, 1, 0);
  const auto place = [&] { return b.session.hand_moves(0).centre(b.bench.file(), 1, 0.0); };
  const std::pair<const char*, DVec3> keys[] = {{"u", {0, 1, 0}},  {"j", {0, 0, 1}},  {"k", {1, 0, 0}},
                                                {"y", {0, -1, 0}}, {"m", {0, 0, -1}}, {"h", {-1, 0, 0}}};
  for (const auto& [key, direction] : keys) {
    const DVec3 before = b.session.hand_moves(0).empty() ? start : place();
    b.controls.press(key);
    EXPECT_TRUE(b.controls.busy());
    b.controls.advance(0.5);
    b.controls.release(key);
    const DVec3 gone = place() - before;
    EXPECT_NEAR(glm::length(gone), 0.5 * b.controls.speed(), 1e-4) << key;
    EXPECT_GT(glm::dot(glm::normalize(gone), direction), 0.9) << key;
  }
  b.controls.press("u");
  b.controls.advance(1.0);
  b.controls.press("b");
  EXPECT_TRUE(b.session.hand_moves(0).empty());
}

TEST(ViewControls, TheShortRayKeyGoesBackToTheRadiusBefore) {
  ControlsBench b;
  b.session.set_setting(0, "ao.radius", "2");
  b.controls.press("4");
  EXPECT_FLOAT_EQ(b.session.pane(0).config.ao.radius, 0.2f);
  b.controls.press("4");
  EXPECT_EQ(b.session.pane(0).config.ao.radius, 2.0f);
}

TEST(ViewControls, OrbitsTurnUntilTheyArePaused) {
  ControlsBench b;
  b.controls.press("c");
  b.controls.advance(1.0);
  const DVec3 turned = b.position();
  EXPECT_NE(turned, DVec3(ViewBench::camera().world_from_camera[3]));
  b.controls.press("space");
  b.controls.advance(1.0);
  EXPECT_EQ(b.position(), turned);
}

TEST(ViewControls, BookmarksBringBackACamera) {
  ControlsBench b;
  b.controls.press("f2", true);
  const DVec3 start = b.position();
  b.controls.drag(MouseButton::kMiddle, 30, 10);
  EXPECT_NE(b.position(), start);
  b.controls.press("f2");
  EXPECT_NEAR(glm::length(b.position() - start), 0.0, 1e-6);
  b.controls.press("home");
  EXPECT_EQ(b.position(), start);
}

TEST(ViewControls, UnknownKeysAreExplained) {
  ControlsBench b;
  EXPECT_EQ(b.controls.press("p"), ViewRequest::kScreenshot);
  EXPECT_THROW(b.controls.press("j"), Error);
  try {
    b.controls.press("ente");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("enter"), std::string::npos) << error.what();
  }
  EXPECT_THROW(b.controls.press("t"), Error) << "nothing moves in this scene";
}

TEST(ViewControls, RecordsItsCameraInTime) {
  ControlsBench b;
  b.controls.record(true);
  b.controls.press("d");
  for (int i = 0; i < 3; ++i) b.controls.advance(0.5);
  b.controls.record(false);
  ASSERT_EQ(b.controls.recorded().size(), 3u);
  EXPECT_EQ(b.controls.recorded()[2].time_s, 1.0);
  EXPECT_NE(camera_path_text(b.controls.recorded()).find("\"time\": 0.500000"), std::string::npos);
}

} // namespace
} // namespace packtrace
