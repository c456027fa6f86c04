#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/frame/still.h"
#include "tests/runtime/view/view_bench.h"

namespace packtrace {
namespace {

using test::ViewBench;

/// The image of this many frames of a separate frame loop, as `render --view` writes it.
RenderedImage shaded_still(const ViewBench& bench, FrameView view, const ShadeConfig& shade, uint32_t frames) {
  FrameConfig config = ViewBench::config().frame;
  config.ao.radius = ao_radius(config.ao, bench.source().world_bounds());
  config.view = view, config.shade = shade;
  FrameLoop loop({&bench.source(), nullptr, {}}, config);
  RenderedImage image;
  Progress progress;
  render_still(loop, ViewBench::camera(), 0.0, frames, false, image, progress);
  return image;
}

TEST(ViewShading, AStillPictureIsThatOfRender) {
  const ViewBench bench(true);
  ViewSession session = bench.session();
  for (const auto& [layer, view] : {std::pair("pbr+ao", FrameView::kPbrAo), std::pair("pbr", FrameView::kPbr)}) {
    session.set_layer(0, layer);
    session.restart();
    test::step(session, 3);
    const RenderedImage expected = shaded_still(bench, view, {}, 3);
    EXPECT_EQ(session.image(0).pbr, expected.pbr) << layer;
    EXPECT_EQ(session.image(0).ao, expected.ao) << layer;
  }
}

TEST(ViewShading, BothShadedViewsAreOfTheSameFrames) {
  const ViewBench bench(true);
  ViewSession session = bench.session();
  session.set_layer(0, "pbr");
  test::step(session, 4);
  session.set_layer(0, "pbr+ao");
  test::step(session, 1);
  EXPECT_EQ(session.last().still_frames, 5u) << "the picture goes on";
  EXPECT_EQ(session.image(0).pbr, shaded_still(bench, FrameView::kPbrAo, {}, 5).pbr);
  session.set_split(SplitMode::kDifference);
  session.set_layer(1, "pbr");
  test::step(session, 2);
  EXPECT_GT(session.metrics().rmse, 0.001) << "the panes show different views";
}

TEST(ViewShading, TheExposureChangesThePictureOnly) {
  const ViewBench bench(true);
  ViewSession session = bench.session();
  session.set_layer(0, "pbr");
  test::step(session, 2);
  const Image before = session.picture();
  session.set_setting(0, "exposure", "-2");
  test::step(session, 1);
  EXPECT_EQ(session.last().still_frames, 3u);
  double dark = 0.0, bright = 0.0;
  for (const float v : session.picture().data) dark += static_cast<double>(v);
  for (const float v : before.data) bright += static_cast<double>(v);
  EXPECT_LT(dark, 0.8 * bright);
}

TEST(ViewShading, TurnedLightsAreThoseOfRender) {
  const ViewBench bench(true);
  ViewSession session = bench.session();
  session.set_layer(0, "pbr");
  test::step(session, 2);
  const std::vector<Vec3> at_rest = session.image(0).pbr;
  for (const double degrees : {30.0, 400.0}) {
    session.turn_lights(degrees);
    test::step(session, 1);
    EXPECT_TRUE(session.last().moving);
  }
  test::step(session, 3);
  ShadeConfig shade;
  shade.light_turn = 40.0f;
  EXPECT_EQ(session.image(0).pbr, shaded_still(bench, FrameView::kPbr, shade, 3).pbr);
  EXPECT_NE(session.image(0).pbr, at_rest);
  const std::vector<std::string> words = session.command(0);
  EXPECT_NE(std::ranges::find(words, "light_turn=40"), words.end());
}

TEST(ViewShading, OcclusionGoesOnWhileLightsTurn) {
  const ViewBench bench(true);
  ViewSession session = bench.session();
  session.set_layer(0, "pbr+ao");
  test::step(session, 8);
  session.turn_lights(10.0);
  test::step(session, 1);
  session.image(0);
  EXPECT_GT(session.last().report.mean_history, 4.0);
  session.set_layer(0, "ao");
  test::step(session, 2);
  session.turn_lights(20.0);
  test::step(session, 1);
  EXPECT_FALSE(session.last().moving) << "no view shows the lights";
}

TEST(ViewShading, FilesWithoutLightsSayWhatTheyNeed) {
  const ViewBench bench;
  ViewSession session = bench.session();
  try {
    session.set_layer(0, "pbr+ao");
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("bake it with --for shading"), std::string::npos) << error.what();
  }
}

} // namespace
} // namespace packtrace
