#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace packtrace {

/// The variance of a mean of n stratified samples falls like n^-kStratifiedPower.
inline constexpr float kStratifiedPower = 1.45f;

/// How fast a pixel's mean converges. Where a history's length n crosses a power of two, the mean differs from that of
/// its first half. The square of this difference is on average 1.73 times the variance that is left: five scenes have
/// factors of 1.5 to 2.3 for n from 4 to 64. By the law above it is 2^kStratifiedPower - 1, since the correlation of
/// the two halves follows from it.
struct Trend {
  static constexpr float kFactor = 1.73f;
  /// Mean of the first half in steps of 1 / kSteps, plus 1; 0: unknown, because the history did not grow frame by
  /// frame.
  uint32_t half = 0;
  /// Variance of the mean times n^kStratifiedPower; 0 if unknown. The upper half of a float.
  float decay = 0.0f;

  static constexpr float kSteps = 65534.0f;
};

/// Trends have 32 bits: decay in the upper half, half in the lower. All bits are 0 if nothing is known.
inline Trend unpack_trend(uint32_t bits) { return {bits & 0xffffu, std::bit_cast<float>(bits & 0xffff0000u)}; }
inline uint32_t pack_trend(const Trend& trend) {
  return ((std::bit_cast<uint32_t>(trend.decay) + 0x8000u) & 0xffff0000u) | trend.half;
}

/// Whether a history that grew by a frame to a length of n >= 1 reached or crossed a power of two.
inline bool crosses_power_of_two(float n) {
  return n - std::bit_cast<float>(std::bit_cast<uint32_t>(n) & 0x7f800000u) < 1.0f;
}

/// 2^(kStratifiedPower e) for histories of 2^e frames, up to 2^24, beyond which floats do not count.
inline const std::array<float, 25>& trend_growth() {
  static const std::array<float, 25> kGrowth = [] {
    std::array<float, 25> growth{};
    for (size_t e = 0; e < growth.size(); ++e)
      growth[e] = static_cast<float>(std::exp2(double{kStratifiedPower} * static_cast<double>(e)));
    return growth;
  }();
  return kGrowth;
}

/// The trend after a power of two is crossed.
/// @param n length of the history, at least 1
inline uint32_t next_trend(uint32_t bits, float mean, float n) {
  const Trend before = unpack_trend(bits);
  Trend trend;
  trend.half = 1 + static_cast<uint32_t>(mean > 0.0f ? mean * Trend::kSteps + 0.5f : 0.5f); // NaN counts as 0
  const auto exponent = static_cast<size_t>((std::bit_cast<uint32_t>(n) >> 23) - 127);
  if (before.half != 0 && exponent >= 2 &&
      exponent < trend_growth().size()) { // two samples say nothing about stratification
    const float change = mean - static_cast<float>(before.half - 1) * (1.0f / Trend::kSteps);
    const float decay = change * change * trend_growth()[exponent] * (1.0f / Trend::kFactor);
    trend.decay = before.decay > 0.0f ? 0.5f * (before.decay + decay) : decay;
  }
  return pack_trend(trend);
}

} // namespace packtrace
