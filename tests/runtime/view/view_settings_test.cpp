#include "runtime/view/view_settings.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

const ViewSetting& find(const std::vector<ViewSetting>& settings, const std::string& name) {
  return *std::ranges::find(settings, name, &ViewSetting::name);
}

std::string message_of(const std::string& name, const std::string& value) {
  FrameConfig config;
  try {
    set_view_setting(config, name, value);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ViewSettings, EverySettingCanBeSetToItsDefault) {
  const FrameConfig defaults;
  FrameConfig config;
  for (const ViewSetting& setting : view_settings(config)) {
    EXPECT_EQ(setting.value, setting.default_value) << setting.name;
    EXPECT_FALSE(setting.help.empty()) << setting.name;
    EXPECT_NO_THROW(set_view_setting(config, setting.name, setting.default_value)) << setting.name;
  }
  EXPECT_TRUE(setting_words(config).empty());
}

TEST(ViewSettings, ChangesAreStatedAsOptionsOfRender) {
  FrameConfig config;
  set_view_setting(config, "ao.lambda", "3.5");
  set_view_setting(config, "ao-rate", "checkerboard");
  set_view_setting(config, "denoiser.window", "5");
  set_view_setting(config, "jitter", "off");
  set_view_setting(config, "supersample", "2");
  set_view_setting(config, "seed", "7");
  set_view_setting(config, "exposure", "-1");
  set_view_setting(config, "tone-map", "aces");
  set_view_setting(config, "shade.depth", "5");
  const std::vector<std::string> words{
      "--supersample", "2",          "--no-jitter", "--exposure",  "-1",         "--ao-rate",
      "checkerboard",  "--seed",     "7",           "--ao-set",    "lambda=3.5", "--denoiser-set",
      "window=5",      "--tone-map", "aces",        "--shade-set", "depth=5"};
  EXPECT_EQ(setting_words(config), words);
  EXPECT_FALSE(same_frames(config, FrameConfig()));
  EXPECT_EQ(find(view_settings(config), "ao.lambda").value, "3.5");
}

TEST(ViewSettings, ExposureChangesNoFrame) {
  FrameConfig config;
  set_view_setting(config, "exposure", "2");
  set_view_setting(config, "tone-map", "aces");
  EXPECT_TRUE(same_frames(config, FrameConfig()));
  set_view_setting(config, "shade.samples", "2");
  EXPECT_FALSE(same_frames(config, FrameConfig()));
}

TEST(ViewSettings, WrongNamesAndValuesAreExplained) {
  EXPECT_NE(message_of("ao.lamda", "1").find("lambda"), std::string::npos);
  EXPECT_NE(message_of("ao-rat", "full").find("did you mean ao-rate"), std::string::npos);
  EXPECT_NE(message_of("ao-rate", "checkerbord").find("did you mean checkerboard"), std::string::npos);
  EXPECT_NE(message_of("ao.lambda", "30").find("[0..20]"), std::string::npos);
  EXPECT_NE(message_of("denoiser.window", "4").find("odd"), std::string::npos);
  EXPECT_NE(message_of("seed", "-1").find("whole number"), std::string::npos);
  EXPECT_NE(message_of("ao.lambda", "1=2"), "accepted");
}

TEST(ViewSettings, ARefusedValueChangesNothing) {
  FrameConfig config;
  EXPECT_THROW(set_view_setting(config, "denoiser.window", "4"), Error);
  EXPECT_TRUE(same_frames(config, FrameConfig()));
  set_view_setting(config, "denoiser", "off");
  EXPECT_THROW(set_view_setting(config, "denoiser.window", "5"), Error);
}

} // namespace
} // namespace packtrace
