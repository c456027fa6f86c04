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
void expect_range(T DenoiserConfig::* field, T low, T high, T below, T above) {
  for (T good : {low, high}) {
    DenoiserConfig config;
    config.*field = good;
    EXPECT_NO_THROW(AoDenoiser{config}) << good;
  }
  for (T bad : {below, above}) {
    SCOPED_TRACE(bad);
    DenoiserConfig config;
    config.*field = bad;
    expect_rejected(config);
  }
}

void expect_float_range(float DenoiserConfig::* field, float low, float high) {
  const float infinity = std::numeric_limits<float>::infinity();
  expect_range(field, low, high, std::nextafter(low, -infinity), std::nextafter(high, infinity));
  DenoiserConfig config;
  config.*field = std::numeric_limits<float>::quiet_NaN();
  expect_rejected(config);
}

TEST(DenoiserConfig, EndsOfEveryRangeAreAcceptedAndWhatLiesBeyondIsRejected) {
  expect_range<uint32_t>(&DenoiserConfig::max_tspp, 1, 65535, 0, 65536);
  expect_range<uint32_t>(&DenoiserConfig::max_tspp_moving, 1, 65535, 0, 65536);
  expect_range<uint32_t>(&DenoiserConfig::fast_frames, 1, 64, 0, 65);
  expect_range<uint32_t>(&DenoiserConfig::window, 3, 9, 2, 10);
  expect_range<uint32_t>(&DenoiserConfig::reprojection_normal_power, 1, 1024, 0, 2048);
  expect_range<uint32_t>(&DenoiserConfig::blur_normal_power, 1, 1024, 0, 2048);
  expect_range<uint32_t>(&DenoiserConfig::disocclusion_frames, 1, 65535, 0, 65536);
  expect_float_range(&DenoiserConfig::change_gamma, 0.1f, 10.0f);
  expect_float_range(&DenoiserConfig::change_tolerance, 0.0f, 1.0f);
  expect_float_range(&DenoiserConfig::change_response, 0.0f, 100.0f);
  expect_float_range(&DenoiserConfig::reprojection_depth, 0.0f, 1.0f);
  expect_float_range(&DenoiserConfig::reprojection_slope, 0.0f, 10.0f);
  expect_float_range(&DenoiserConfig::blur_depth, 0.0f, 1.0f);
  expect_float_range(&DenoiserConfig::blur_slope, 0.0f, 10.0f);
  expect_float_range(&DenoiserConfig::blur_limit, 1.25f, 100.0f);
  expect_float_range(&DenoiserConfig::blur_trust_frames, 0.0f, 1000.0f);
}

TEST(DenoiserConfig, EvenWindowsPowersThatAreNoneAndEmptyFadesAreRejected) {
  DenoiserConfig config;
  config.window = 4;
  expect_rejected(config);
  config = {};
  config.blur_normal_power = 48;
  expect_rejected(config);
  config = {};
  config.reprojection_normal_power = 3;
  expect_rejected(config);
  config = {};
  config.blur_fade_begin = config.blur_fade_end;
  expect_rejected(config);
  config = {};
  config.blur_fade_end = 65536;
  expect_rejected(config);
}

TEST(DenoiserConfig, MessagesNameTheField) {
  DenoiserConfig config;
  config.change_gamma = 11.0f;
  try {
    config.validate();
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("change_gamma"), std::string::npos) << error.what();
  }
}

} // namespace
} // namespace packtrace
