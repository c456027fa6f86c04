#include "runtime/view/view_session.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/frame/still.h"
#include "tests/runtime/view/view_bench.h"

namespace packtrace {
namespace {

using test::ViewBench;

/// The image of this many frames of a separate frame loop, as `render` writes it.
RenderedImage still(const ViewBench& bench, const FrameConfig& config, const Camera& camera, uint32_t frames) {
  FrameLoop loop({&bench.source(), nullptr, {}}, config);
  RenderedImage image;
  Progress progress;
  render_still(loop, camera, 0.0, frames, false, image, progress);
  return image;
}

FrameConfig of_render(const ViewBench& bench) {
  FrameConfig config = ViewBench::config().frame;
  config.ao.radius = ao_radius(config.ao, bench.source().world_bounds());
  return config;
}

void expect_equal(const RenderedImage& a, const RenderedImage& b) {
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.ao, b.ao);
  EXPECT_EQ(a.ao_raw, b.ao_raw);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.shaded, b.shaded);
  EXPECT_EQ(a.variance, b.variance);
}

TEST(ViewSession, AStillPictureIsThatOfRender) {
  const ViewBench bench;
  ViewSession session = bench.session();
  for (const uint32_t frames : {1u, 2u, 7u}) {
    test::step(session, frames - session.last().still_frames);
    EXPECT_EQ(session.last().still_frames, frames);
    expect_equal(session.image(0), still(bench, of_render(bench), ViewBench::camera(), frames));
  }
}

TEST(ViewSession, SoItIsAfterMovementsAtAnyQuality) {
  const ViewBench bench;
  ViewSession session = bench.session();
  test::step(session, 3);
  for (const uint32_t quality : {0u, 3u, 6u}) {
    session.fix_quality(quality);
    for (int i = 0; i < 4; ++i) {
      session.move_camera([](ViewCamera& camera) { camera.move({0.1, 0, 0.05}); });
      test::step(session, 1);
      EXPECT_TRUE(session.last().moving);
      EXPECT_TRUE(session.command(0).empty());
      EXPECT_EQ(session.image(0).size, at_quality_step(of_render(bench), quality).size);
    }
    test::step(session, 5);
    EXPECT_EQ(session.last().still_frames, 5u);
    expect_equal(session.image(0), still(bench, of_render(bench), session.camera().camera(), 5));
  }
}

TEST(ViewSession, ResolvingOftenChangesNothing) {
  const ViewBench bench;
  ViewSession often = bench.session(), once = bench.session();
  often.keep_views(true), once.keep_views(true);
  for (int i = 0; i < 6; ++i) {
    test::step(often, 1);
    often.image(0);
  }
  test::step(once, 6);
  expect_equal(often.image(0), once.image(0));
}

TEST(ViewSession, AnotherViewDoesNotRestartThePicture) {
  const ViewBench bench;
  ViewSession session = bench.session();
  test::step(session, 4);
  session.set_layer(0, "variance");
  test::step(session, 1);
  EXPECT_EQ(session.last().still_frames, 5u);
  session.set_setting(0, "ao.lambda", "3");
  test::step(session, 1);
  EXPECT_EQ(session.last().still_frames, 1u);
  EXPECT_THROW(session.set_layer(0, "varience"), Error);
  EXPECT_THROW(session.set_layer(0, "lod"), Error) << "no levels";
  EXPECT_EQ(session.pane(0).layer, "variance");
}

TEST(ViewSession, FramesDoNotDependOnTheNumberOfThreads) {
  const ViewBench bench;
  std::vector<RenderedImage> images;
  for (const size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    ViewSession session = bench.session();
    session.set_split(SplitMode::kDifference);
    session.set_layer(1, PaneState::kGroundTruth);
    test::step(session, 2);
    session.move_camera([](ViewCamera& camera) { camera.look(3, 1); });
    test::step(session, 2);
    images.push_back(session.image(0));
    images.push_back(session.image(1));
  }
  expect_equal(images[0], images[2]);
  expect_equal(images[1], images[3]);
}

TEST(ViewSession, TheGroundTruthHasNoDenoiserAndFourSamples) {
  const ViewBench bench;
  ViewSession session = bench.session();
  session.set_layer(0, PaneState::kGroundTruth);
  test::step(session, 3);
  FrameConfig truth = of_render(bench);
  truth.denoise = false, truth.ao.spp = 4;
  expect_equal(session.image(0), still(bench, truth, ViewBench::camera(), 3));
}

TEST(ViewSession, PanesAlikeShareTheirFrames) {
  const ViewBench bench;
  ViewSession session = bench.session();
  session.set_split(SplitMode::kDivider);
  session.set_layer(1, "depth");
  test::step(session, 1);
  EXPECT_EQ(session.last().report.primary_rays, 48u * 32u);
  EXPECT_EQ(&session.image(0), &session.image(1));
  session.set_setting(1, "ao.radius", "0.3");
  test::step(session, 1);
  EXPECT_EQ(session.last().report.primary_rays, 2u * 48u * 32u);
  EXPECT_NE(session.image(0).ao, session.image(1).ao);
  session.set_divider(0.25);
  EXPECT_EQ(session.pane_at(11), 0u);
  EXPECT_EQ(session.pane_at(12), 1u);
}

TEST(ViewSession, EqualPanesDifferNowhere) {
  const ViewBench bench;
  ViewSession session = bench.session(2);
  session.set_split(SplitMode::kDifference);
  test::step(session, 1);
  EXPECT_EQ(session.last().report.primary_rays, 2u * 48u * 32u) << "two files are rendered both";
  test::step(session, 3);
  EXPECT_EQ(session.metrics().rmse, 0.0);
  EXPECT_GT(session.metrics().pixels, 400u);
  session.set_setting(1, "ao.lambda", "0.5");
  test::step(session, 4);
  const DifferenceMetrics metrics = session.metrics();
  EXPECT_GT(metrics.rmse, 0.005);
  EXPECT_GT(metrics.flip, 0.0);
  session.set_layer(1, "normal");
  test::step(session, 1);
  EXPECT_THROW(session.metrics(), Error) << "a number and a colour";
}

TEST(ViewSession, ACancelledFrameLeavesNoTrace) {
  const ViewBench bench;
  ViewSession session = bench.session();
  test::step(session, 3);
  for (const int tiles : {0, 1, 3}) { // at the camera rays, and at the occlusion rays
    int left = tiles;
    Progress stopping([&](std::string_view, uint64_t, uint64_t) {
      if (left-- <= 0) throw Error(ErrorKind::kCancelled, "input");
    });
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const bool finished = session.step(stopping);
    EXPECT_TRUE(!finished || tiles > 0);
    test::step(session, 3);
    expect_equal(session.image(0), still(bench, of_render(bench), ViewBench::camera(), 3 + (finished ? 4 : 0)));
    session.restart();
    test::step(session, 3);
  }
}

TEST(ViewSession, PicksAreTheValuesOfTheImage) {
  const ViewBench bench;
  ViewSession session = bench.session();
  session.keep_views(true);
  test::step(session, 8);
  const RenderedImage& image = session.image(0);
  const Pick ball = session.pick(0, 24, 16), sky = session.pick(0, 24, 0);
  const size_t at = 16 * 48 + 24;
  EXPECT_EQ(ball.ao, image.ao[at]);
  EXPECT_EQ(ball.depth, image.depth[at]);
  EXPECT_EQ(ball.instance, image.instance[at]);
  EXPECT_EQ(ball.views.size(), 6u);
  ASSERT_TRUE(ball.surface);
  EXPECT_NEAR(glm::length(ball.surface->position - DVec3(0, 1, 0)), 1.0, 0.02) << "on the ball";
  EXPECT_EQ(ball.surface->material_name, "chalk");
  EXPECT_EQ(ball.surface->flags, "none");
  EXPECT_FALSE(sky.hit);
  EXPECT_THROW(session.pick(0, 48, 0), Error);
}

TEST(ViewSession, LayersThatNoOneLooksAtAreMadeWhenSomeoneDoes) {
  const ViewBench bench;
  ViewSession plain = bench.session(), asked = bench.session();
  plain.keep_views(true);
  for (int i = 0; i < 3; ++i) {
    for (ViewSession* session : {&plain, &asked}) {
      session->move_camera([](ViewCamera& camera) { camera.move({0.1, 0, 0}); });
      test::step(*session, 1);
    }
    EXPECT_EQ(asked.picture().data, plain.picture().data);
    EXPECT_EQ(asked.pick(0, 24, 16).normal, plain.pick(0, 24, 16).normal);
    EXPECT_EQ(asked.image(0).shaded, plain.image(0).shaded);
    EXPECT_EQ(asked.image(0).instance, plain.image(0).instance);
  }
}

TEST(ViewSession, SettlingRendersWhatChanged) {
  const ViewBench bench;
  ViewSession session = bench.session();
  Progress progress;
  EXPECT_TRUE(session.settle(progress));
  EXPECT_EQ(session.last().still_frames, 1u);
  EXPECT_TRUE(session.settle(progress));
  EXPECT_EQ(session.last().still_frames, 1u) << "nothing changed";
  session.move_camera([](ViewCamera& camera) { camera.move({0.5, 0, 0}); });
  EXPECT_TRUE(session.settle(progress));
  EXPECT_TRUE(session.last().moving);
  EXPECT_TRUE(session.command(0).empty());
  test::step(session, 3);
  session.set_setting(0, "ao.radius", "0.5");
  EXPECT_TRUE(session.settle(progress));
  EXPECT_EQ(session.last().still_frames, 1u);
}

TEST(ViewSession, TellsWhatTheFileConsistsOf) {
  const ViewBench bench;
  ViewSession session = bench.session();
  EXPECT_THROW(session.contents(0), Error) << "nothing is traced yet";
  test::step(session, 1);
  const FileContents contents = session.contents(1);
  EXPECT_TRUE(contents.streams.empty()) << "floats have no streams";
  EXPECT_TRUE(contents.plan.empty());
  ASSERT_FALSE(contents.resident.empty());
  for (const auto& [name, bytes] : contents.resident) EXPECT_GT(bytes, 0u) << name;
}

TEST(ViewSession, AnyWindowSizeWorks) {
  const ViewBench bench;
  ViewSession session = bench.session();
  for (const ImageSize size : {ImageSize{1, 1}, ImageSize{3, 200}, ImageSize{64, 48}}) {
    session.resize(size);
    test::step(session, 2);
    EXPECT_EQ(session.picture().size, size);
    EXPECT_EQ(session.last().still_frames, 2u);
  }
  EXPECT_THROW(session.resize({0, 10}), Error);
  EXPECT_THROW(session.resize({70000, 10}), Error);
}

TEST(ViewSession, AReplacedFileIsShownFromTheSameCamera) {
  const ViewBench bench;
  ViewSession session = bench.session();
  session.move_camera([](ViewCamera& camera) { camera.move({0.5, 0, 0}); });
  test::step(session, 4);
  const ViewBench other;
  session.replace_file(0, other.file("new.pbrt"), ViewCamera(ViewBench::camera(), DVec3(0), DVec3(0, 1, 0), 6.0));
  test::step(session, 4);
  EXPECT_EQ(session.last().still_frames, 4u);
  expect_equal(session.image(0), still(other, of_render(other), session.camera().camera(), 4));
}

} // namespace
} // namespace packtrace
