#include "runtime/image/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/runtime/image/image_test_support.h"

namespace packtrace {
namespace {

using MetricFunction = Metric (*)(const Image&, const Image&, const MetricOptions&);
Metric default_flip(const Image& a, const Image& b, const MetricOptions& o) { return flip(a, b, o); }
constexpr MetricFunction kAll[] = {rmse, mae, psnr, p99, ssim, default_flip};

TEST(Metrics, EqualImagesHaveNoError) {
  const Image image = noise_image({32, 24}, 3, 1);
  EXPECT_EQ(rmse(image, image).value, 0.0);
  EXPECT_EQ(mae(image, image).value, 0.0);
  EXPECT_EQ(psnr(image, image).value, std::numeric_limits<double>::infinity());
  EXPECT_EQ(ssim(image, image).value, 1.0);
  EXPECT_EQ(flip(image, image).value, 0.0);
}

TEST(Metrics, ConstantImagesHaveTheirAnalyticValues) {
  const double a = 0.25, b = 0.75;
  const Image low({16, 12}, 3, 0.25f), high({16, 12}, 3, 0.75f);
  EXPECT_DOUBLE_EQ(rmse(low, high).value, 0.5);
  EXPECT_DOUBLE_EQ(mae(low, high).value, 0.5);
  EXPECT_NEAR(psnr(low, high).value, 6.020599913, 1e-8);
  EXPECT_NEAR(ssim(low, high).value, (2 * a * b + 1e-4) / (a * a + b * b + 1e-4), 1e-12);
}

TEST(Metrics, OneDifferentSampleWeighsAsItShould) {
  Image test({10, 10}, 2, 0.5f);
  const Image reference = test;
  test.pixel(3, 4)[1] = 0.9f;
  EXPECT_NEAR(rmse(test, reference).value, 0.4 / std::sqrt(200.0), 1e-7);
  EXPECT_NEAR(mae(test, reference).value, 0.4 / 200.0, 1e-8);
  const Metric with_map = rmse(test, reference, {{}, true});
  EXPECT_NEAR(with_map.error_map.pixel(3, 4)[0], 0.4 / std::sqrt(2.0), 1e-6);
  EXPECT_EQ(std::count(with_map.error_map.data.begin(), with_map.error_map.data.end(), 0.0f), 99);
}

TEST(Metrics, TheNinetyNinthPercentileLeavesOnePixelInAHundredOut) {
  Image test({20, 10}, 1, 0.5f);
  const Image reference = test;
  test.pixel(0, 0)[0] = 1.0f, test.pixel(1, 0)[0] = 0.75f;
  EXPECT_EQ(p99(test, reference).value, 0.0) << "two of 200 pixels differ";
  test.pixel(2, 0)[0] = 0.625f;
  EXPECT_EQ(p99(test, reference).value, 0.125) << "the third largest of 200";
  std::vector<uint8_t> valid(200, 1);
  valid[1] = 0;
  EXPECT_EQ(p99(test, reference, {valid}).value, 0.125) << "the second largest of 199";
}

TEST(Metrics, AllAreSymmetric) {
  const Image a = noise_image({24, 20}, 3, 1), b = noise_image({24, 20}, 3, 2);
  for (const MetricFunction metric : kAll) EXPECT_DOUBLE_EQ(metric(a, b, {}).value, metric(b, a, {}).value);
}

TEST(Metrics, AllAreTheSameForAnyNumberOfThreads) {
  const Image a = noise_image({61, 47}, 1, 1), b = noise_image({61, 47}, 1, 2);
  for (const MetricFunction metric : kAll) {
    const Metric parallel = metric(a, b, {{}, true});
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Metric serial = metric(a, b, {{}, true});
    EXPECT_EQ(parallel.value, serial.value);
    EXPECT_EQ(parallel.error_map.data, serial.error_map.data);
  }
}

TEST(Metrics, PixelsThatDoNotCountHaveNoInfluence) {
  const Image reference = noise_image({30, 30}, 1, 1);
  Image test = reference;
  for (float& value : test.data) value = std::min(1.0f, value + 0.05f);
  std::vector<uint8_t> valid(test.size.pixels(), 1);
  for (size_t i = 0; i < valid.size(); i += 7) valid[i] = 0;
  Image garbage = test;
  for (size_t i = 0; i < valid.size(); i += 7)
    garbage.data[i] = i % 2 ? kInvalidAo : std::numeric_limits<float>::quiet_NaN();
  for (const MetricFunction metric : kAll) {
    const Metric clean = metric(test, reference, {valid, true}), dirty = metric(garbage, reference, {valid, true});
    EXPECT_EQ(clean.value, dirty.value);
    EXPECT_EQ(clean.error_map.data, dirty.error_map.data);
    for (size_t i = 0; i < valid.size(); i += 7) EXPECT_EQ(dirty.error_map.data[i], 0.0f);
  }
}

TEST(Metrics, AMaskOfOnesChangesNothing) {
  const Image a = noise_image({20, 20}, 1, 1), b = noise_image({20, 20}, 1, 2);
  const std::vector<uint8_t> ones(a.size.pixels(), 1);
  for (const MetricFunction metric : kAll) EXPECT_NEAR(metric(a, b, {}).value, metric(a, b, {ones}).value, 1e-12);
}

TEST(Metrics, ImagesThatCannotBeComparedAreInputErrors) {
  const Image a({16, 16}, 1), smaller({15, 16}, 1), more_channels({16, 16}, 3);
  Image nan = a;
  nan.data[5] = std::numeric_limits<float>::quiet_NaN();
  const std::vector<uint8_t> none(a.size.pixels(), 0), short_mask(3, 1);
  for (const MetricFunction metric : kAll) {
    const auto kind = [&](const Image& x, const MetricOptions& options = {}) {
      return error_kind_of([&] { metric(x, a, options); });
    };
    EXPECT_EQ(kind(smaller), ErrorKind::kInput);
    EXPECT_EQ(kind(more_channels), ErrorKind::kInput);
    EXPECT_EQ(kind(nan), ErrorKind::kInput);
    EXPECT_EQ(kind(a, {none}), ErrorKind::kInput);
    EXPECT_EQ(kind(a, {short_mask}), ErrorKind::kInput);
    EXPECT_EQ(error_kind_of([&] { metric(Image(), Image(), {}); }), ErrorKind::kInput);
  }
}

TEST(Ssim, OneWindowMatchesTheDefinition) {
  // An image of 11 x 11 pixels has a single window, so its SSIM is equation 13 with explicit weights.
  const Image x = noise_image({11, 11}, 1, 1), y = noise_image({11, 11}, 1, 2);
  double weights = 0, mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
  for (uint32_t j = 0; j < 11; ++j)
    for (uint32_t i = 0; i < 11; ++i) {
      const double dx = i - 5.0, dy = j - 5.0, w = std::exp(-(dx * dx + dy * dy) / 4.5);
      const double a = x.pixel(i, j)[0], b = y.pixel(i, j)[0];
      weights += w, mx += w * a, my += w * b, xx += w * a * a, yy += w * b * b, xy += w * a * b;
    }
  mx /= weights, my /= weights;
  const double vx = xx / weights - mx * mx, vy = yy / weights - my * my, cov = xy / weights - mx * my;
  const double expected = (2 * mx * my + 1e-4) * (2 * cov + 9e-4) / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4));
  EXPECT_NEAR(ssim(x, y).value, expected, 1e-12);
}

TEST(Ssim, DropsAsAnImageIsShiftedFurther) {
  const ImageSize size{64, 64};
  const auto wave = [&](double shift) {
    Image image(size, 1);
    for (uint32_t y = 0; y < size.height; ++y)
      for (uint32_t x = 0; x < size.width; ++x)
        image.pixel(x, y)[0] = static_cast<float>(0.5 + 0.4 * std::sin((x + shift) * 0.3) * std::cos(y * 0.2));
    return image;
  };
  double previous = 1.0;
  for (const double shift : {0.5, 1.0, 2.0, 4.0}) {
    const double value = ssim(wave(shift), wave(0)).value;
    EXPECT_LT(value, previous);
    previous = value;
  }
  EXPECT_LT(previous, 0.7);
}

TEST(Ssim, InvertedStructureIsNegative) {
  const Image x = noise_image({32, 32}, 1, 1);
  Image inverted = x;
  for (float& value : inverted.data) value = 1.0f - value;
  EXPECT_LT(ssim(x, inverted).value, -0.8);
}

TEST(Ssim, ImagesSmallerThanTheWindowAreInputErrors) {
  EXPECT_EQ(error_kind_of([] { ssim(Image({10, 40}, 1), Image({10, 40}, 1)); }), ErrorKind::kInput);
  std::vector<uint8_t> border_only(12 * 12, 0);
  border_only[0] = 1;
  EXPECT_EQ(error_kind_of([&] { ssim(Image({12, 12}, 1), Image({12, 12}, 1), {border_only}); }), ErrorKind::kInput);
}

} // namespace
} // namespace packtrace
