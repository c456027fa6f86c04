#include "runtime/denoise/denoiser.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

void expect_rejected(const DenoiserConfig& config) {
  try {
    AoDenoiser denoiser(config);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  }
}

template <typename T>
void expect_range(T FluxConfig::* field, T low, T high, T below, T above) {
  for (T good : {low, high}) {
    DenoiserConfig config;
    config.ours.*field = good;
    EXPECT_NO_THROW(AoDenoiser{config}) << good;
  }
  for (T bad : {below, above}) {
    SCOPED_TRACE(bad);
    DenoiserConfig config;
    config.ours.*field = bad;
    expect_rejected(config);
  }
}

void expect_float_range(float FluxConfig::* field, float low, float high) {
  const float infinity = std::numeric_limits<float>::infinity();
  expect_range(field, low, high, std::nextafter(low, -infinity), std::nextafter(high, infinity));
  DenoiserConfig config;
  config.ours.*field = std::numeric_limits<float>::quiet_NaN();
  expect_rejected(config);
}

TEST(DenoiserConfig, EndsOfEveryRangeAreAcceptedAndWhatLiesBeyondIsRejected) {
  expect_range<uint32_t>(&FluxConfig::max_tspp, 1, 65535, 0, 65536);
  expect_range<uint32_t>(&FluxConfig::max_tspp_moving, 1, 65535, 0, 65536);
  expect_range<uint32_t>(&FluxConfig::fast_frames, 1, 64, 0, 65);
  expect_range<uint32_t>(&FluxConfig::window, 3, 9, 2, 10);
  expect_range<uint32_t>(&FluxConfig::reprojection_normal_power, 1, 1024, 0, 2048);
  expect_range<uint32_t>(&FluxConfig::passes, 0, 4, 5, 6);
  expect_float_range(&FluxConfig::change_gamma, 0.1f, 10.0f);
  expect_float_range(&FluxConfig::change_tolerance, 0.0f, 1.0f);
  expect_float_range(&FluxConfig::change_response, 0.0f, 100.0f);
  expect_float_range(&FluxConfig::reprojection_depth, 0.0f, 1.0f);
  expect_float_range(&FluxConfig::reprojection_slope, 0.0f, 10.0f);
  expect_float_range(&FluxConfig::reprojection_nearby, 0.0f, 1.0f);
  expect_float_range(&FluxConfig::guide_depth, 0.0f, 1.0f);
  expect_float_range(&FluxConfig::guide_slope, 0.0f, 10.0f);
  expect_float_range(&FluxConfig::guide_bend, 0.0f, 10.0f);
  expect_float_range(&FluxConfig::patch_limit, 0.1f, 25.0f);
  expect_float_range(&FluxConfig::variance_distrust, 0.0f, 1000.0f);
}

TEST(DenoiserConfig, EvenWindowsAndPowersThatAreNoneAreRejected) {
  DenoiserConfig config;
  config.ours.window = 4;
  expect_rejected(config);
  config = {};
  config.ours.reprojection_normal_power = 48;
  expect_rejected(config);
  config = {};
  config.ours.reprojection_normal_power = 3;
  expect_rejected(config);
}

TEST(DenoiserConfig, MessagesNameTheField) {
  DenoiserConfig config;
  config.ours.change_gamma = 11.0f;
  try {
    config.validate();
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("change_gamma"), std::string::npos) << error.what();
  }
}

TEST(DenoiserConfig, SettingsAreAssignedByName) {
  DenoiserConfig config;
  config.set("window=5");
  config.set("change_gamma=0.5");
  config.set("reprojection_instance_test=off");
  EXPECT_EQ(config.ours.window, 5u);
  EXPECT_EQ(config.ours.change_gamma, 0.5f);
  EXPECT_FALSE(config.ours.reprojection_instance_test);
}

TEST(DenoiserConfig, WrongAssignmentsSayWhatIsAllowed) {
  const auto message_of = [](const char* assignment) -> std::string {
    DenoiserConfig config;
    try {
      config.set(assignment);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kUsage);
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message_of("windw=5"), "denoiser: no setting 'windw'; did you mean window?");
  EXPECT_EQ(message_of("window"), "denoiser: 'window' is not of the form NAME=VALUE");
  EXPECT_EQ(message_of("window=6"), "denoiser: window is 6, not odd");
  EXPECT_EQ(message_of("window=5.5"), "denoiser: window is 5.5, not a whole number");
  EXPECT_EQ(message_of("window=11"), "denoiser: window is 11, not in [3..9]");
  EXPECT_EQ(message_of("change_gamma=nan"), "denoiser: change_gamma is nan, not in [0.1..10]");
  EXPECT_EQ(message_of("change_gamma=1x"), "denoiser: the value of change_gamma is '1x', not a number, on or off");
}

TEST(DenoiserConfig, EverySettingOfBothDenoisersIsDescribedAndItsDefaultAllowed) {
  for (const DenoiserKind kind : {DenoiserKind::kOurs, DenoiserKind::kReference}) {
    DenoiserConfig config;
    config.kind = kind;
    const std::vector<SettingView> settings = denoiser_settings(config);
    ASSERT_FALSE(settings.empty());
    for (const SettingView& setting : settings) {
      SCOPED_TRACE(std::string(setting.info.name));
      EXPECT_FALSE(setting.info.help.empty());
      EXPECT_EQ(setting.value, setting.default_value);
      EXPECT_NO_THROW(check_setting(setting.info, setting.is_integer, setting.default_value, "denoiser"));
    }
  }
}

} // namespace
} // namespace packtrace
