// Shading in the frame loop.

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/frame/still.h"
#include "tests/runtime/shade/shaded_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

class ShadedFrames : public testing::Test {
protected:
  ShadedFrames() {
    test::add_shaded(scene_, test::floor_quad(3.0f), {}, Vec3(0.8f, 0.5f, 0.3f));
    SurfaceShading plastic;
    plastic.bits = kFresnelDielectric, plastic.specular = Vec3(1.0f);
    test::add_shaded(scene_, test::sphere(Vec3(0, 1, 0), 1.0f, 24), plastic);
    test::add_shaded(scene_, test::quad(Vec3(-1, 4, -1), Vec3(2, 0, 0), Vec3(0, 0, 2)), test::emitter(Vec3(5.0f)));
    config_.size = {48, 32};
    config_.ao.radius = 1.0f;
    config_.view = FrameView::kPbrAo;
  }
  static Camera camera(double x = 0.5) { return test::camera_at(DVec3(x, 2, -6), DVec3(0, 1, 0), 50.0); }
  RenderedImage still(const FrameConfig& config, uint32_t frames) const {
    const FloatSource source(scene_);
    FrameLoop loop({&source, nullptr, {}}, config);
    RenderedImage image;
    Progress progress;
    render_still(loop, camera(), 0.0, frames, false, image, progress);
    return image;
  }
  static double error(const RenderedImage& a, const RenderedImage& b) {
    double sum = 0.0;
    for (size_t i = 0; i < a.pbr.size(); ++i) sum += double{glm::length(a.pbr[i] - b.pbr[i])};
    return sum / static_cast<double>(a.pbr.size());
  }

  Scene scene_;
  FrameConfig config_;
};

TEST_F(ShadedFrames, ConvergeToTheMean) {
  FrameConfig config = config_;
  config.jitter = false;
  const RenderedImage many = still(config, 256);
  const double after_2 = error(still(config, 2), many), after_32 = error(still(config, 32), many);
  EXPECT_LT(after_32, 0.4 * after_2);
  EXPECT_LT(after_32, 0.02);
}

TEST_F(ShadedFrames, AreDenoised) {
  FrameConfig config = config_;
  config.jitter = false, config.view = FrameView::kPbr;
  config.shade.light_samples = 1;
  FrameConfig raw = config;
  raw.denoise = false;
  const RenderedImage truth = still(raw, 512);
  EXPECT_LT(error(still(config, 1), truth), 0.6 * error(still(raw, 1), truth));
  EXPECT_LT(error(still(config, 8), truth), 0.9 * error(still(raw, 8), truth));
  EXPECT_LT(error(still(config, 256), truth), 1.1 * error(still(raw, 256), truth)); // the filter fades
}

TEST_F(ShadedFrames, TakeTheirMeansAlongWithTheCamera) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const FloatSource source(scene_);
  const auto last_of_path = [&](const FrameConfig& config, int frames, bool forget) {
    FrameLoop loop({&source, nullptr, {}}, config);
    Progress progress;
    for (int i = frames - 1; i >= 0; --i) {
      if (forget) loop.reset();
      loop.next_frame(camera(0.5 + 0.01 * i), 0.0, progress);
    }
    RenderedImage image;
    PictureReport report;
    loop.resolve(image, report);
    return image;
  };
  FrameConfig raw = config_;
  raw.denoise = raw.jitter = false;
  const RenderedImage truth = still(raw, 512);
  const double followed = error(last_of_path(config_, 24, false), truth),
               alone = error(last_of_path(config_, 24, true), truth);
  EXPECT_LT(followed, 0.75 * alone);
}

TEST_F(ShadedFrames, FollowLightsThatTurn) {
  Light sun;
  sun.kind = LightKind::kDistant, sun.radiance = Vec3(3.0f), sun.direction = glm::normalize(Vec3(1, 1, -1));
  scene_.lights.push_back(sun);
  const FloatSource source(scene_);
  FrameConfig config = config_;
  FrameLoop loop({&source, nullptr, {}}, config);
  Progress progress;
  for (int i = 0; i < 32; ++i) loop.next_frame(camera(), 0.0, progress);
  loop.turn_lights(150.0f);
  for (int i = 0; i < 24; ++i) loop.next_frame(camera(), 0.0, progress);
  RenderedImage turned;
  PictureReport report;
  loop.resolve(turned, report);
  config.shade.light_turn = 150.0f;
  const RenderedImage fresh = still(config, 56), before = still(config_, 56);
  EXPECT_LT(error(turned, fresh), 0.25 * error(before, fresh)); // 5 of 29 frames are older
}

TEST_F(ShadedFrames, ForgetOnReset) {
  const FloatSource source(scene_);
  FrameLoop loop({&source, nullptr, {}}, config_);
  Progress progress;
  for (int i = 0; i < 3; ++i) loop.next_frame(camera(0.6), 0.0, progress);
  loop.reset();
  loop.next_frame(camera(), 0.0, progress);
  RenderedImage image;
  PictureReport report;
  loop.resolve(image, report);
  EXPECT_EQ(image.pbr, still(config_, 1).pbr);
}

TEST_F(ShadedFrames, OcclusionDarkensTheAmbientLightOnly) {
  FrameConfig config = config_;
  config.jitter = false;
  const RenderedImage with = still(config, 4);
  config.view = FrameView::kPbr;
  const RenderedImage without = still(config, 4);
  EXPECT_EQ(with.direct, without.direct);
  EXPECT_EQ(with.specular, without.specular);
  bool darker = false;
  for (size_t i = 0; i < with.pbr.size(); ++i) {
    const Vec3 ambient = without.pbr[i] - without.direct[i] - without.specular[i];
    const Vec3 expected = with.direct[i] + with.specular[i] + ambient * std::max(with.ao[i], 0.0f);
    EXPECT_NEAR(with.pbr[i].x, expected.x, 1e-4f) << i;
    darker = darker || with.pbr[i].x < without.pbr[i].x - 0.01f;
  }
  EXPECT_TRUE(darker);
}

TEST_F(ShadedFrames, SupersamplingFiltersDown) {
  FrameConfig fine = config_;
  fine.jitter = false, fine.supersample = 2;
  FrameConfig large = fine;
  large.supersample = 1, large.size = {96, 64};
  large.view = fine.view = FrameView::kPbr;
  const RenderedImage small = still(fine, 2), all = still(large, 2);
  for (uint32_t y = 0; y < 32; ++y)
    for (uint32_t x = 0; x < 48; ++x) {
      Vec3 sum(0.0f);
      for (uint32_t sub = 0; sub < 4; ++sub) sum += all.pbr[(2 * y + sub / 2) * 96 + 2 * x + sub % 2];
      EXPECT_NEAR(small.pbr[y * 48 + x].y, 0.25f * sum.y, 1e-5f);
    }
}

TEST_F(ShadedFrames, ContinueFromTheirSavedState) {
  const FloatSource source(scene_);
  const auto finish = [&](FrameLoop& loop) {
    Progress progress;
    for (int i = 0; i < 3; ++i) loop.next_frame(camera(), 0.0, progress);
    for (int i = 0; i < 2; ++i) loop.next_frame(camera(0.51), 0.0, progress);
    RenderedImage image;
    PictureReport report;
    loop.resolve(image, report);
    return image.pbr;
  };
  FrameLoop loop({&source, nullptr, {}}, config_);
  Progress progress;
  for (int i = 0; i < 3; ++i) loop.next_frame(camera(), 0.0, progress);
  const std::vector<std::byte> saved = loop.save();
  FrameLoop restored({&source, nullptr, {}}, config_);
  restored.restore(camera(), 0.0, saved);
  EXPECT_EQ(finish(loop), finish(restored));
  FrameConfig plain = config_;
  plain.view = FrameView::kAo;
  FrameLoop other({&source, nullptr, {}}, plain);
  EXPECT_THROW(other.restore(camera(), 0.0, saved), Error);
}

TEST_F(ShadedFrames, NeedShading) {
  scene_.has_shading = false;
  const FloatSource source(scene_);
  try {
    FrameLoop loop({&source, nullptr, {}}, config_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
    EXPECT_NE(std::string(error.what()).find("--for shading"), std::string::npos);
  }
}

TEST_F(ShadedFrames, SettingsAreDocumented) {
  std::ifstream in(std::filesystem::path(PACKTRACE_SOURCE_DIR) / "docs/shading.md");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  for (const Setting<ShadeConfig>& setting : shade_settings()) {
    const std::string row = "| `" + std::string(setting.info.name) + "` | " + setting_range(setting.info) + " | " +
                            setting_text(setting.default_value()) + " |";
    EXPECT_NE(text.find(row), std::string::npos) << row;
  }
}

TEST_F(ShadedFrames, SettingsHaveRanges) {
  for (const Setting<ShadeConfig>& setting : shade_settings()) {
    ShadeConfig config;
    EXPECT_NO_THROW(check_setting(setting.info, !setting.is_real(), setting.default_value(), "shading"));
    EXPECT_THROW(assign_setting(shade_settings(), std::string(setting.info.name) + "=-1", config, "shading"), Error);
    EXPECT_EQ(config, ShadeConfig{});
  }
}

} // namespace
} // namespace packtrace
