#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "runtime/ao/ao_config.h"
#include "runtime/simd.h"

namespace packtrace {

/// Returns e^x for x in [-80, 0], with an error below 2e-7 of the result. The bits do not depend on the C library.
inline float exp_of_negative(float x) {
  const float y = x * 1.44269504f;
  const auto whole = static_cast<int32_t>(y);                     // rounds up
  const float f = (y - static_cast<float>(whole)) * 0.693147181f; // in (-0.7, 0]
  const float power =
      1.0f +
      f * (1.0f +
           f * (1.0f / 2 + f * (1.0f / 6 + f * (1.0f / 24 + f * (1.0f / 120 + f * (1.0f / 720 + f * (1.0f / 5040)))))));
  return power * std::bit_cast<float>((whole + 127) << 23);
}

/// Visibility of a sample as a function of its hit distance; see AoConfig.
class VisibilityCurve {
public:
  explicit VisibilityCurve(const AoConfig& config)
      : lambda_(config.falloff ? config.lambda : 0.0f), darkening_(1.0f - config.min_visibility),
        rho_(config.interreflection) {
    if (!config.falloff) return;
    if (config.lambda > 0.0f && config.cutoff > 0.0f)
      end_ = static_cast<float>(std::min(1.0, std::sqrt(-std::log(double{config.cutoff}) / double{config.lambda})));
    const double floor = config.continuous ? std::exp(-double{lambda_} * double{end_} * double{end_}) : 0.0;
    if (config.continuous && 1.0 - floor < 1e-6) { // the limit for lambda -> 0
      parabola_ = 1.0f / (end_ * end_);
    } else {
      floor_ = static_cast<float>(floor), scale_ = static_cast<float>(1.0 / (1.0 - floor));
    }
  }

  /// Length of the rays (x_end), in radii.
  float end() const { return end_; }

  // The constants of visibility(), for kernels in other languages.
  float lambda() const { return lambda_; }
  float darkening() const { return darkening_; }
  float floor() const { return floor_; }
  float scale() const { return scale_; }
  float parabola() const { return parabola_; }

  /// @param x hit distance in radii, >= 0
  /// @param luminance luminance of the hit surface's albedo; used only with interreflection
  float visibility(float x, float luminance) const {
    const float x2 = smaller(x * x, end_ * end_);
    const float occlusion =
        parabola_ > 0.0f ? 1.0f - x2 * parabola_ : (exp_of_negative(-lambda_ * x2) - floor_) * scale_;
    const float k = 1.0f - darkening_ * smaller(larger(occlusion, 0.0f), 1.0f);
    return k / larger(1.0f - rho_ * luminance * (1.0f - k), 1e-30f); // k is 0 where the denominator is
  }

private:
  float lambda_, darkening_, rho_;
  float end_ = 1.0f;
  float floor_ = 0.0f, scale_ = 1.0f;
  float parabola_ = 0.0f; ///< > 0: occlusion is 1 - parabola_ x^2
};

} // namespace packtrace
