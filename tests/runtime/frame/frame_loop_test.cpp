#include "runtime/frame/frame_loop.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/frame/still.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

/// A floor with a ball and thin posts before an open background.
class FrameBench {
public:
  FrameBench() {
    test::add_shape(scene_, test::quad(Vec3(-4, 0, -4), Vec3(0, 0, 8), Vec3(8, 0, 0)));
    test::add_shape(scene_, test::sphere(Vec3(0, 1, 0), 1.0f, 24));
    for (int i = 0; i < 6; ++i) {
      const float x = -3.0f + 1.1f * static_cast<float>(i);
      test::add_shape(scene_, test::box(Vec3(x, 0, 1), Vec3(x + 0.06f, 3, 1.06f)));
    }
    source_ = std::make_unique<FloatSource>(scene_);
    config_.size = {64, 48};
    config_.ao.radius = 1.0f;
  }

  FrameScene frame_scene() const { return {source_.get(), nullptr, {}}; }
  static Camera camera(double x = 0.5) { return test::camera_at(DVec3(x, 2, -6), DVec3(0, 1, 0), 50.0); }
  RenderedImage still(const FrameConfig& config, uint32_t frames) const {
    FrameLoop loop(frame_scene(), config);
    RenderedImage image;
    Progress progress;
    render_still(loop, camera(), 0.0, frames, false, image, progress);
    return image;
  }

  Scene scene_;
  std::unique_ptr<FloatSource> source_;
  FrameConfig config_;
};

double mean_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(double{a[i]} - double{b[i]});
  return sum / static_cast<double>(a.size());
}

void expect_equal_images(const RenderedImage& a, const RenderedImage& b) {
  EXPECT_EQ(a.ao, b.ao);
  EXPECT_EQ(a.ao_raw, b.ao_raw);
  EXPECT_EQ(a.coverage, b.coverage);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.shaded, b.shaded);
}

TEST(FrameLoop, LayersThatNoOneLooksAtTakeNoMemory) {
  const FrameBench bench;
  FrameLoop loop(bench.frame_scene(), bench.config_);
  RenderedImage image;
  Progress progress;
  render_still(loop, FrameBench::camera(), 0.0, 1, false, image, progress);
  EXPECT_EQ(image.normal.size(), bench.config_.size.pixels());
  FrameConfig few = bench.config_;
  few.plain_layers = 0;
  loop.show_layers(few);
  PictureReport report;
  loop.resolve(image, report);
  EXPECT_EQ(image.normal.capacity() + image.shaded.capacity() + image.instance.capacity(), 0u);
}

TEST(FrameLoop, CameraRaysAreTracedAgainForLayersThatNoOneWantedBefore) {
  const FrameBench bench;
  FrameConfig few = bench.config_;
  few.all_channels = false, few.plain_layers = 0;
  Progress progress;
  for (const uint32_t frames : {1u, 2u, 5u}) {
    FrameLoop loop(bench.frame_scene(), few);
    RenderedImage image;
    render_still(loop, FrameBench::camera(), 0.0, frames, false, image, progress);
    const GBuffer& g = loop.gbuffer();
    EXPECT_EQ(g.albedo.capacity() + g.material.capacity() + g.triangle.capacity() + g.back_face.capacity(), 0u);
    FrameConfig all = few;
    all.plain_layers = kAllPlainLayers;
    loop.show_layers(all);
    PictureReport report;
    loop.resolve(image, report);
    expect_equal_images(image, bench.still(bench.config_, frames));
    render_picture(loop, FrameBench::camera(), 0.0, 4, image, progress);
    expect_equal_images(image, bench.still(bench.config_, frames + 4));
  }
}

TEST(FrameLoop, ExpectedMovementTakesLessMemoryAndChangesNoResult) {
  const FrameBench bench;
  FrameConfig quarter = bench.config_, plain = bench.config_;
  quarter.ao_resolution = AoResolution::kQuarter, plain.jitter = false;
  for (const FrameConfig& config : {bench.config_, quarter, plain}) {
    FrameLoop kept(bench.frame_scene(), config), passing(bench.frame_scene(), config);
    passing.expect_movement(true);
    Progress progress;
    for (const double x : {0.5, 0.6, 0.6, 0.6, 0.6, 0.7, 0.8, 0.8}) { // moves, stands still, and moves again
      RenderedImage expected, image;
      PictureReport report;
      kept.next_frame(FrameBench::camera(x), 0.0, progress), kept.resolve(expected, report);
      const bool moved = passing.next_frame(FrameBench::camera(x), 0.0, progress).moved;
      passing.resolve(image, report);
      expect_equal_images(image, expected);
      if (!moved) continue;
      EXPECT_EQ(passing.gbuffer().has_points(), config.ao_resolution == AoResolution::kQuarter) << "for upsampling";
      EXPECT_LT(passing.denoiser().state_bytes(), kept.denoiser().state_bytes());
    }
  }
}

TEST(FrameLoop, JitteredStillsConvergeToSupersampledOnes) {
  const FrameBench bench;
  FrameConfig reference = bench.config_;
  reference.jitter = false, reference.supersample = 8, reference.denoise = false;
  const RenderedImage truth = bench.still(reference, 8);
  FrameConfig plain = bench.config_;
  plain.jitter = false;
  const RenderedImage aliased = bench.still(plain, 64), smooth = bench.still(bench.config_, 64);
  const auto all_layers = [&](const RenderedImage& image, const auto& layer) {
    return mean_difference(layer(image), layer(truth));
  };
  const auto coverage = [](const RenderedImage& i) { return i.coverage; };
  const auto depth = [](const RenderedImage& i) { return i.depth; };
  const auto ao = [](const RenderedImage& i) {
    std::vector<float> covered = i.ao;
    for (size_t p = 0; p < covered.size(); ++p) covered[p] = i.coverage[p] > 0.0f ? covered[p] * i.coverage[p] : 0.0f;
    return covered;
  };
  EXPECT_LT(all_layers(smooth, coverage), 0.25 * all_layers(aliased, coverage));
  EXPECT_LT(all_layers(smooth, ao), 0.4 * all_layers(aliased, ao));
  EXPECT_GT(all_layers(aliased, depth), 0.0);
}

TEST(FrameLoop, OneFrameIsTracedThroughPixelCentres) {
  const FrameBench bench;
  FrameConfig plain = bench.config_;
  plain.jitter = false;
  expect_equal_images(bench.still(plain, 1), bench.still(bench.config_, 1));
}

TEST(FrameLoop, ImagesDoNotDependOnTheNumberOfThreads) {
  const FrameBench bench;
  const auto with_threads = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return bench.still(bench.config_, 6);
  };
  expect_equal_images(with_threads(1), with_threads(4));
}

TEST(FrameLoop, ReportsWhatMoved) {
  const FrameBench bench;
  FrameLoop loop(bench.frame_scene(), bench.config_);
  Progress progress;
  EXPECT_TRUE(loop.next_frame(bench.camera(), 0.0, progress).moved);
  EXPECT_FALSE(loop.next_frame(bench.camera(), 0.0, progress).moved);
  EXPECT_TRUE(loop.next_frame(bench.camera(0.6), 0.0, progress).moved);
  EXPECT_EQ(loop.next_frame(bench.camera(0.6), 0.0, progress).number, 3u);
  loop.reset();
  const FrameReport& again = loop.next_frame(bench.camera(0.6), 0.0, progress);
  EXPECT_TRUE(again.moved);
  EXPECT_EQ(again.number, 0u);
  EXPECT_GT(again.hit_pixels, 0u);
  EXPECT_EQ(again.primary_rays, bench.config_.size.pixels());
}

TEST(FrameLoop, MovingCamerasKeepTheirHistory) {
  const FrameBench bench;
  FrameLoop loop(bench.frame_scene(), bench.config_);
  Progress progress;
  RenderedImage image;
  PictureReport report;
  for (int i = 0; i < 8; ++i) report = render_picture(loop, bench.camera(0.5 + 0.02 * i), 0.0, 1, image, progress);
  EXPECT_GT(report.mean_history, 5.0);
}

/// The pictures of a camera that moves, stops and moves on.
std::vector<RenderedImage> moving_pictures(FrameLoop& loop, int first, int last) {
  std::vector<RenderedImage> pictures;
  Progress progress;
  for (int i = first; i < last; ++i) {
    RenderedImage image;
    render_picture(loop, FrameBench::camera(i < 3 ? 0.1 * i : 0.3), 0.0, 3, image, progress);
    pictures.push_back(image);
  }
  return pictures;
}

TEST(FrameLoop, ContinuesFromASavedState) {
  const FrameBench bench;
  for (const bool denoise : {true, false})
    for (const AoResolution resolution : {AoResolution::kFull, AoResolution::kQuarter}) {
      FrameConfig config = bench.config_;
      config.denoise = denoise, config.ao_resolution = resolution;
      FrameLoop whole(bench.frame_scene(), config);
      const std::vector<RenderedImage> expected = moving_pictures(whole, 0, 7);
      for (const int stop : {1, 3, 5}) {
        FrameLoop before(bench.frame_scene(), config), after(bench.frame_scene(), config);
        moving_pictures(before, 0, stop);
        after.restore(bench.camera(stop - 1 < 3 ? 0.1 * (stop - 1) : 0.3), 0.0, before.save());
        const std::vector<RenderedImage> rest = moving_pictures(after, stop, 7);
        for (size_t i = 0; i < rest.size(); ++i) expect_equal_images(rest[i], expected[i + static_cast<size_t>(stop)]);
      }
    }
}

/// A box above a floor, at its place at rest or where its motion puts it at a time.
Scene scene_with_box(std::optional<double> placed_at_s) {
  Scene scene;
  test::add_shape(scene, test::quad(Vec3(-4, 0, -4), Vec3(0, 0, 8), Vec3(8, 0, 0)));
  const uint32_t shape = test::add_shape(scene, test::box(Vec3(-0.5f), Vec3(0.5f)));
  const double x = placed_at_s ? 2.0 * *placed_at_s - 1.0 : -1.0;
  scene.shapes[shape].parent_from_mesh = DAffine(DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1), DVec3(x, 1, 0));
  return scene;
}

/// The box moves from x = -1 to 1 within a second.
RigidMotion motion_of_box() {
  RigidMotion motion;
  MotionTrack track;
  track.keys.resize(2);
  track.keys[0].translation = DVec3(-1, 1, 0);
  track.keys[1].time_s = 1.0, track.keys[1].translation = DVec3(1, 1, 0);
  motion.tracks.push_back(track);
  motion.instances.push_back({.instance = 1, .track = 0});
  return motion;
}

TEST(FrameLoop, InstancesMoveWithTime) {
  Scene moving = scene_with_box({});
  moving.motion = motion_of_box();
  const FloatSource source(moving);
  const SceneMotion motion = SceneMotion::of(moving);
  FrameConfig config = FrameBench().config_;
  config.jitter = false;
  FrameLoop loop({&source, nullptr, {}, &motion}, config);
  Progress progress;
  for (const double time_s : {0.0, 0.25, 0.25, 0.75}) {
    RenderedImage image, expected;
    render_picture(loop, FrameBench::camera(), time_s, 1, image, progress);
    const Scene still = scene_with_box(time_s);
    const FloatSource still_source(still);
    FrameLoop still_loop({&still_source, nullptr, {}}, config);
    render_picture(still_loop, FrameBench::camera(), 0.0, 1, expected, progress);
    ASSERT_EQ(image.depth.size(), expected.depth.size());
    size_t different = 0;
    for (size_t i = 0; i < image.depth.size(); ++i)
      different += std::abs(image.depth[i] - expected.depth[i]) > 1e-4f * expected.depth[i] ? 1 : 0;
    EXPECT_LE(different, 3u) << time_s; // rays that graze an edge
  }
  EXPECT_FALSE(loop.next_frame(FrameBench::camera(), 0.75, progress).moved);
  EXPECT_TRUE(loop.next_frame(FrameBench::camera(), 0.5, progress).moved);
  float largest = 0.0f;
  for (size_t i = 0; i < loop.gbuffer().motion_px.size(); ++i) {
    const float x = std::abs(loop.gbuffer().motion_px[i].x);
    if (loop.gbuffer().instance[i] == 0) {
      EXPECT_EQ(x, 0.0f); // the floor stands still
    }
    if (loop.gbuffer().instance[i] == 1) largest = std::max(largest, x);
  }
  EXPECT_GT(largest, 2.0f); // pixels
}

TEST(FrameLoop, DamagedStatesAreRejected) {
  const FrameBench bench;
  FrameLoop loop(bench.frame_scene(), bench.config_);
  moving_pictures(loop, 0, 2);
  const std::vector<std::byte> state = loop.save();
  for (const size_t size : {size_t{0}, size_t{8}, size_t{24}, state.size() - 1})
    EXPECT_THROW(loop.restore(bench.camera(), 0.0, std::span(state).first(size)), Error) << size;
}

TEST(FrameLoop, SettingsOutOfRangeAreRejected) {
  const FrameBench bench;
  const auto rejected = [&](const std::function<void(FrameConfig&)>& change) {
    FrameConfig config = bench.config_;
    change(config);
    EXPECT_THROW(FrameLoop(bench.frame_scene(), config), Error);
  };
  rejected([](FrameConfig& c) { c.size.width = 0; });
  rejected([](FrameConfig& c) { c.supersample = 9; });
  rejected([](FrameConfig& c) { c.size = {65537, 1}; });
  rejected([](FrameConfig& c) { c.ao.radius = -1.0f; });
  rejected([](FrameConfig& c) { c.detail.error_px = 1.0; }); // floats have no levels
  rejected([](FrameConfig& c) { c.detail.error_px = std::nan(""); });
}

TEST(Jitter, OffsetsFillThePixelEvenly) {
  EXPECT_EQ(jitter_offset(0), glm::dvec2(0.0));
  std::array<int, 9> cells{};
  glm::dvec2 mean(0.0);
  for (uint32_t i = 0; i < 45; ++i) {
    const glm::dvec2 offset = jitter_offset(i);
    EXPECT_TRUE(std::abs(offset.x) <= 0.5 && std::abs(offset.y) <= 0.5);
    mean += offset / 45.0;
    const auto cell = [](double x) { return std::min(2, static_cast<int>((x + 0.5) * 3.0)); };
    ++cells[static_cast<size_t>(3 * cell(offset.y) + cell(offset.x))];
  }
  EXPECT_LT(glm::length(mean), 0.04);
  for (const int count : cells) EXPECT_NEAR(count, 5, 2);
}

} // namespace
} // namespace packtrace
