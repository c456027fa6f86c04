#include "runtime/view/hand_moves.h"

#include <algorithm>
#include <fstream>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/frame/still.h"
#include "runtime/motion/motion_keys.h"
#include "tests/runtime/view/view_bench.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using test::ViewBench;

constexpr uint32_t kBall = 1;

/// The image of `render --keys` with the keys of the moved instances.
RenderedImage still_by_keys(const ViewBench& bench, const std::string& keys, const Camera& camera, uint32_t frames) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "keys.json";
  std::ofstream(file) << keys;
  SceneMotion motion = bench.motion();
  motion.add(read_motion_keys(file, bench.targets()), bench.targets());
  FrameConfig config = ViewBench::config().frame;
  config.ao.radius = ao_radius(config.ao, bench.source().world_bounds());
  FrameLoop loop({&bench.source(), nullptr, {}, &motion}, config);
  RenderedImage image;
  Progress progress;
  render_still(loop, camera, 0.0, frames, false, image, progress);
  return image;
}

TEST(HandMoves, AStillPictureIsThatOfTheKeys) {
  const ViewBench bench;
  ViewSession session = bench.session();
  test::step(session, 2);
  session.select(0, 24, 16);
  for (const DVec3 by : {DVec3(0.3, 0.1, 0), DVec3(40, 0, 3), DVec3(-39.5, 0, 0)}) { // also beyond the scene's bounds
    session.move_selected(by);
    test::step(session, 2);
    session.move_selected(by * 0.01);
    test::step(session, 4);
    EXPECT_EQ(session.last().still_frames, 3u);
    const std::string keys = session.hand_moves(0).keys_text(session.files()[0]);
    const RenderedImage expected = still_by_keys(bench, keys, session.camera().camera(), 3);
    EXPECT_EQ(session.image(0).ao, expected.ao);
    EXPECT_EQ(session.image(0).depth, expected.depth);
  }
}

TEST(HandMoves, TheCommandNamesTheKeys) {
  const ViewBench bench;
  ViewSession session = bench.session();
  test::step(session, 2);
  session.select(0, 24, 16);
  session.move_selected({0.5, 0, 0});
  test::step(session, 3);
  const auto has = [&](const std::string& word) {
    const std::vector<std::string> words = session.command(0);
    return std::ranges::find(words, word) != words.end();
  };
  session.set_keys_file(0, "saved.json");
  EXPECT_TRUE(has("--keys") && has("saved.json") && has("--start-time"));
  session.move_selected({0.5, 0, 0});
  test::step(session, 3);
  EXPECT_FALSE(has("saved.json")) << "it holds the keys of before";
  session.put_selected_back();
  test::step(session, 3);
  EXPECT_FALSE(has("--keys"));
}

TEST(HandMoves, WhatIsMovedBackIsAsBefore) {
  const ViewBench bench;
  ViewSession session = bench.session();
  session.move_camera([](ViewCamera& camera) { camera.move({0.1, 0, 0}); });
  test::step(session, 4);
  const std::vector<float> before = session.image(0).ao;
  session.select(0, 24, 16);
  session.move_selected({0.5, 0, 0});
  test::step(session, 4);
  EXPECT_NE(session.image(0).ao, before);
  session.put_selected_back();
  test::step(session, 4);
  EXPECT_EQ(session.image(0).ao, before);
}

TEST(HandMoves, OnlyWhatIsPickedAndFreeMoves) {
  const ViewBench bench;
  ViewSession session = bench.session();
  test::step(session, 1);
  EXPECT_THROW(session.move_selected({1, 0, 0}), Error);
  EXPECT_FALSE(session.gizmo());
  session.select(0, 24, 30);
  EXPECT_THROW(session.move_selected({1, 0, 0}), Error) << "the ground";
  EXPECT_TRUE(session.hand_moves(0).empty());
  session.select(0, 24, 16);
  ASSERT_TRUE(session.selection());
  EXPECT_EQ(session.selection()->instance, kBall);
  EXPECT_THROW(session.move_selected({1e31, 0, 0}), Error);
  session.select(0, 24, 0);
  EXPECT_FALSE(session.selection()) << "the sky";
}

TEST(HandMoves, AHandleFollowsTheMouse) {
  const ViewBench bench;
  ViewSession session = bench.session();
  test::step(session, 1);
  session.select(0, 24, 16);
  const Gizmo before = session.gizmo().value();
  ASSERT_TRUE(before.tips[0]);
  const glm::dvec2 arrow = *before.tips[0] - before.centre;
  session.drag_gizmo(0, 0.5 * arrow);
  const Gizmo after = session.gizmo().value();
  EXPECT_NEAR(glm::length(after.centre - (before.centre + 0.5 * arrow)), 0.0, 0.01);
  const DVec3 place = session.hand_moves(0).centre(session.files()[0], kBall, 0.0);
  EXPECT_NEAR(place.x, 0.5 * before.length, 1e-6);
  EXPECT_NEAR(place.y, 1.0, 1e-3);
}

} // namespace
} // namespace packtrace
