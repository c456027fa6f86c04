#include "runtime/denoise/noise_level.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace packtrace {
namespace {

constexpr int kStride = 4;              // pixels between pairs, along x and y
constexpr float kLeastHistory = 8.0f;   // before, the variance of a pixel is a guess
constexpr float kLeastVariance = 1e-6f; // no noise, nothing to compare
constexpr uint64_t kLeastPairs = 64;
constexpr float kMedian = 0.4549364f; // of the chi-squared distribution with one degree of freedom
constexpr float kLeastRatio = 1.0f / 64.0f;

/// Counts of positive floats in bins of a quarter octave from 2^-16 to 2^16; what lies outside goes to the end bins.
class Histogram {
public:
  void add(float value) {
    const int bits = static_cast<int>(std::bit_cast<uint32_t>(value) >> 21); // exponent and two bits of mantissa
    ++bins_[static_cast<size_t>(std::clamp(bits - kFirst, 0, kBins - 1))];
    ++total_;
  }

  uint64_t total() const { return total_; }

  /// Interpolated within its bin.
  float median() const {
    uint64_t below = 0;
    size_t bin = 0;
    while (2 * (below + bins_[bin]) < total_) below += bins_[bin++];
    const float within =
        static_cast<float>(total_ - 2 * below) / (2.0f * static_cast<float>(std::max<uint64_t>(bins_[bin], 1)));
    const float low = edge(bin), high = edge(bin + 1);
    return low + (high - low) * within;
  }

private:
  static constexpr int kBins = 32 * 4, kFirst = (127 - 16) * 4;
  static float edge(size_t bin) {
    return std::bit_cast<float>(static_cast<uint32_t>(static_cast<int>(bin) + kFirst) << 21);
  }
  std::array<uint64_t, kBins> bins_{};
  uint64_t total_ = 0;
};

} // namespace

float noise_ratio(const Guides& guides, const History& history, std::span<const float> variance) {
  const int width = static_cast<int>(guides.size.width), height = static_cast<int>(guides.size.height);
  Histogram ratios;
  for (int y = kStride / 2; y < height; y += kStride) {
    const float *mean = history.mean.row(y), *samples = history.samples.row(y);
    const float* row_variance = &variance[static_cast<size_t>(y) * guides.size.width];
    for (int x = 0; x + 1 < width; x += kStride) {
      const bool usable = samples[x] >= kLeastHistory && samples[x + 1] >= kLeastHistory &&
                          row_variance[x] >= kLeastVariance && row_variance[x + 1] >= kLeastVariance;
      if (!usable) continue;
      const float difference = mean[x + 1] - mean[x];
      ratios.add(difference * difference / (row_variance[x] + row_variance[x + 1]));
    }
  }
  if (ratios.total() < kLeastPairs) return 1.0f;
  return std::clamp(ratios.median() / kMedian, kLeastRatio, 1.0f);
}

} // namespace packtrace
