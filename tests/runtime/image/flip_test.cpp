#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "runtime/image/flip_stages.h"
#include "runtime/image/metrics.h"
#include "tests/runtime/image/image_test_support.h"

namespace packtrace {
namespace {

constexpr double kPi = std::numbers::pi;

/// FLIP of one pixel computed directly from the paper's formulas with two-dimensional filters. It shares only the
/// colour space conversions with the code under test; those are tested separately.
double flip_by_definition(const Image& test, const Image& reference, int px, int py, double ppd) {
  const auto opponent = [](const Image& image, int x, int y) {
    x = std::clamp(x, 0, static_cast<int>(image.size.width) - 1);
    y = std::clamp(y, 0, static_cast<int>(image.size.height) - 1);
    const auto p = image.pixel(static_cast<uint32_t>(x), static_cast<uint32_t>(y));
    return ycxcz_from_linear_rgb({p[0], p[1], p[2]});
  };
  const double a[3][2] = {{1, 0}, {1, 0}, {34.1, 13.5}}, b[3][2] = {{0.0047, 1e-5}, {0.0053, 1e-5}, {0.04, 0.025}};
  const auto seen_color = [&](const Image& image) {
    DVec3 filtered(0), weights(0);
    const int radius = static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * ppd));
    for (int dy = -radius; dy <= radius; ++dy)
      for (int dx = -radius; dx <= radius; ++dx) {
        const DVec3 value = opponent(image, px + dx, py + dy);
        const double z = (dx * dx + dy * dy) / (ppd * ppd);
        for (int c = 0; c < 3; ++c)
          for (int i = 0; i < 2; ++i) {
            const double w = a[c][i] * std::sqrt(kPi / b[c][i]) * std::exp(-kPi * kPi * z / b[c][i]);
            filtered[c] += w * value[c], weights[c] += w;
          }
      }
    return hunt_lab_from_linear_rgb(glm::clamp(linear_rgb_from_ycxcz(filtered / weights), 0.0, 1.0));
  };
  const auto feature = [&](const Image& image, bool point) {
    const double sd = 0.5 * 0.082 * ppd;
    const int radius = static_cast<int>(std::ceil(3 * sd));
    double strength = 0.0;
    for (const bool along_y : {false, true}) {
      double sum[2] = {0, 0}, norm[2] = {0, 0};
      for (int dy = -radius; dy <= radius; ++dy)
        for (int dx = -radius; dx <= radius; ++dx) {
          const double t = along_y ? dy : dx, g = std::exp(-(dx * dx + dy * dy) / (2 * sd * sd));
          const double w = point ? (t * t / (sd * sd) - 1) * g : -t * g;
          sum[w > 0] += w * (opponent(image, px + dx, py + dy).x + 16) / 116, norm[w > 0] += std::abs(w);
        }
      const double response = sum[0] / norm[0] + sum[1] / norm[1];
      strength += response * response;
    }
    return std::sqrt(strength);
  };
  const double distance = std::pow(hyab_distance(seen_color(test), seen_color(reference)), 0.7),
               most = 41.276098414595445;
  const double color =
      distance < 0.4 * most ? 0.95 * distance / (0.4 * most) : 0.95 + 0.05 * (distance - 0.4 * most) / (0.6 * most);
  const double features = std::max(std::abs(feature(test, false) - feature(reference, false)),
                                   std::abs(feature(test, true) - feature(reference, true)));
  return std::pow(color, 1 - std::sqrt(features / std::sqrt(2.0)));
}

TEST(FlipStages, TheLargestColourDistanceIsThatOfGreenAndBlue) {
  EXPECT_NEAR(flip_max_color_distance(), 41.276098414595445, 1e-9);
  const double corners[2] = {0.0, 1.0};
  double largest = 0.0;
  for (int i = 0; i < 64; ++i) {
    const DVec3 a(corners[i & 1], corners[i >> 1 & 1], corners[i >> 2 & 1]);
    const DVec3 b(corners[i >> 3 & 1], corners[i >> 4 & 1], corners[i >> 5 & 1]);
    largest = std::max(largest, hyab_distance(hunt_lab_from_linear_rgb(a), hunt_lab_from_linear_rgb(b)));
  }
  EXPECT_NEAR(std::pow(largest, 0.7), flip_max_color_distance(), 1e-12);
}

TEST(FlipStages, WhiteAndBlackAreWhereCielabPutsThem) {
  const DVec3 white = hunt_lab_from_linear_rgb(DVec3(1)), black = hunt_lab_from_linear_rgb(DVec3(0));
  EXPECT_NEAR(hyab_distance(white, {100, 0, 0}), 0.0, 1e-9);
  EXPECT_NEAR(hyab_distance(black, {0, 0, 0}), 0.0, 1e-9);
  // Green is L 87.7, a -86.2, b 83.2 in CIELAB before the Hunt adjustment by 0.877.
  const DVec3 green = hunt_lab_from_linear_rgb({0, 1, 0});
  EXPECT_NEAR(green.x, 87.7362, 1e-3);
  EXPECT_NEAR(green.y / 0.877362, -86.1787, 2e-2);
  EXPECT_NEAR(green.z / 0.877362, 83.1827, 2e-2);
}

TEST(FlipStages, OpponentSpaceRoundTripsAndKeepsGreyNeutral) {
  Noise noise(3);
  for (int i = 0; i < 100; ++i) {
    const DVec3 rgb(noise(), noise(), noise());
    EXPECT_LT(glm::length(linear_rgb_from_ycxcz(ycxcz_from_linear_rgb(rgb)) - rgb), 1e-12);
  }
  EXPECT_LT(glm::length(ycxcz_from_linear_rgb(DVec3(0.5)) - DVec3(42, 0, 0)), 1e-9);
}

TEST(FlipStages, ColourErrorsAreRedistributedAsPublished) {
  EXPECT_EQ(flip_color_error(0.0), 0.0);
  EXPECT_NEAR(flip_color_error(std::pow(0.4 * flip_max_color_distance(), 1 / 0.7)), 0.95, 1e-12);
  EXPECT_NEAR(flip_color_error(std::pow(flip_max_color_distance(), 1 / 0.7)), 1.0, 1e-12);
  for (double d = 0.0; d < 200.0; d += 1.0) EXPECT_LT(flip_color_error(d), flip_color_error(d + 1.0));
}

TEST(FlipStages, FiltersAreNormalised) {
  const auto sum = [](const std::vector<double>& v, bool positive) {
    return std::accumulate(v.begin(), v.end(), 0.0,
                           [&](double s, double w) { return (w > 0) == positive ? s + w : s; });
  };
  for (const double ppd : {5.0, 67.0, 200.0}) {
    for (const auto channel :
         {OpponentChannel::kAchromatic, OpponentChannel::kRedGreen, OpponentChannel::kBlueYellow}) {
      double shares = 0.0;
      for (const CsfTerm& term : csf_terms(channel, ppd)) {
        shares += term.share;
        EXPECT_NEAR(sum(term.kernel, true), 1.0, 1e-12);
      }
      EXPECT_NEAR(shares, 1.0, 1e-12);
    }
    const FeatureKernels kernels = feature_kernels(ppd);
    EXPECT_NEAR(sum(kernels.smooth, true), 1.0, 1e-12);
    for (const auto* kernel : {&kernels.edge, &kernels.point}) {
      EXPECT_NEAR(sum(*kernel, true), 1.0, 1e-12);
      EXPECT_NEAR(sum(*kernel, false), -1.0, 1e-12);
    }
  }
  // Kernel radius at the default distance: 3 sigma of the widest filter.
  EXPECT_EQ(csf_terms(OpponentChannel::kAchromatic, kFlipPixelsPerDegree)[0].kernel.size(), 2u * 10 + 1);
  EXPECT_EQ(feature_kernels(kFlipPixelsPerDegree).edge.size(), 2u * 9 + 1);
}

TEST(Flip, MatchesTheDefinitionPixelByPixel) {
  const Image test = noise_image({23, 18}, 3, 1), reference = noise_image({23, 18}, 3, 2);
  for (const double ppd : {20.0, kFlipPixelsPerDegree}) {
    const Metric metric = flip(test, reference, {{}, true}, ppd);
    for (const auto& [x, y] : {std::pair{11, 9}, {0, 0}, {22, 17}, {3, 16}})
      EXPECT_NEAR(metric.error_map.pixel(static_cast<uint32_t>(x), static_cast<uint32_t>(y))[0],
                  flip_by_definition(test, reference, x, y, ppd), 1e-6);
  }
}

TEST(Flip, BlackAgainstWhiteIsTheirColourDistance) {
  // Constant images have no features and are not changed by filters. HyAB is 100, which maps to an error of 0.96738.
  const Image black({16, 16}, 3, 0.0f), white({16, 16}, 3, 1.0f);
  EXPECT_NEAR(flip(black, white).value, 0.9673797614921327, 1e-6);
  EXPECT_NEAR(flip(Image({16, 16}, 1, 0.5f), Image({16, 16}, 1, 0.6f)).value, 0.19621471154646333, 1e-6);
}

TEST(Flip, GreyAndColourImagesOfTheSameGreyAgree) {
  const Image a = noise_image({20, 20}, 1, 1), b = noise_image({20, 20}, 1, 2);
  EXPECT_EQ(flip(a, b).value, flip(grey_to_rgb(a), grey_to_rgb(b)).value);
}

TEST(Flip, GrowsWithTheErrorAndStaysInRange) {
  const Image reference = noise_image({40, 40}, 1, 1), noise = noise_image({40, 40}, 1, 2);
  double previous = 0.0;
  for (const float amount : {0.02f, 0.1f, 0.3f, 1.0f, 100.0f}) {
    Image test = reference;
    for (size_t i = 0; i < test.data.size(); ++i) test.data[i] += amount * (noise.data[i] - 0.5f);
    const Metric metric = flip(test, reference, {{}, true});
    EXPECT_GT(metric.value, previous);
    previous = metric.value;
    EXPECT_GE(*std::min_element(metric.error_map.data.begin(), metric.error_map.data.end()), 0.0f);
    EXPECT_LE(*std::max_element(metric.error_map.data.begin(), metric.error_map.data.end()), 1.0f);
  }
}

TEST(Flip, FineNoiseIsHarderToSeeFromFurtherAway) {
  const Image reference({64, 64}, 1, 0.5f);
  Image test = reference;
  for (size_t i = 0; i < test.data.size(); ++i) test.data[i] += (i + i / 64) % 2 ? 0.1f : -0.1f;
  EXPECT_LT(flip(test, reference, {}, 120.0).value, flip(test, reference, {}, 20.0).value);
}

TEST(Flip, RejectsChannelsAndDistancesItIsNotDefinedFor) {
  const Image two({16, 16}, 2), one({16, 16}, 1);
  EXPECT_EQ(error_kind_of([&] { flip(two, two); }), ErrorKind::kInput);
  for (const double ppd : {0.0, -1.0, std::nan(""), 1e9})
    EXPECT_EQ(error_kind_of([&] { flip(one, one, {}, ppd); }), ErrorKind::kUsage);
}

} // namespace
} // namespace packtrace
