#include "runtime/denoise/flux_terms.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "runtime/denoise/kernels/trend.h"

namespace packtrace {
namespace {

/// Factor of reprojection_depth where the depths of the surfaces in the previous frame are unknown: the camera or the
/// surfaces may have come nearer.
constexpr float kUnknownDepthFactor = 4.0f;

/// VarianceTerms::young of independent samples. The ratio of stratified ones has a similar effect: variances of young
/// pixels are rather too large, so that they are filtered more.
constexpr float kIndependentYoung = 12.0f;

} // namespace

float located_depth(const FluxConfig& config, bool knows_previous_z) {
  return config.reprojection_depth * (knows_previous_z ? 1.0f : kUnknownDepthFactor);
}

float longest_moving(const FluxConfig& config) {
  return static_cast<float>(std::min(config.max_tspp, config.max_tspp_moving));
}

CorrectTerms correct_terms(const FluxConfig& config) {
  const float share = 1.0f / static_cast<float>(config.fast_frames);
  return {share / (2.0f - share), config.change_gamma, config.change_tolerance, config.change_response,
          static_cast<float>(config.fast_frames)};
}

PatchTerms patch_terms(const FluxConfig& config) {
  const double limit = 9.0 * config.patch_limit * kDistanceUnits;
  PatchTerms t;
  t.no_distance = static_cast<uint16_t>(std::lround(kDistanceUnits / config.noise_tolerance));
  t.shift = std::countl_zero(static_cast<uint16_t>(limit));
  t.limit = static_cast<uint16_t>(std::ldexp(limit, t.shift));
  t.stretch = static_cast<uint16_t>(65536.0 * (65535.0 / t.limit - 1.0));
  return t;
}

VarianceTerms variance_terms(const FluxConfig& config, bool moving, bool stratified, uint32_t samples) {
  VarianceTerms t;
  t.tolerance = config.noise_tolerance, t.prior = config.variance_prior, t.distrust = config.variance_distrust,
  t.ratio_prior = config.ratio_prior;
  t.longest_moving = static_cast<float>(config.max_tspp_moving), t.moving = moving;
  t.stratified = stratified;
  t.per_sample = 1.0f / static_cast<float>(samples);
  if (t.stratified)
    t.still_factor = 0.75f, t.still_power = kStratifiedPower - 1.0f, t.moving_base = 0.55f, t.moving_gain = 0.02f;
  else
    t.young = kIndependentYoung;
  t.most_spread = t.per_sample * std::min(1.0f, t.still_factor * std::pow(t.per_sample, t.still_power));
  return t;
}

} // namespace packtrace
