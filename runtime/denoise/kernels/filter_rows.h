#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "pbrt_import/base/isa.h"

namespace packtrace {

/// Offsets (x, y) of the pairs of pixels that a filter pass compares, in units of its step. The other four neighbours
/// are the same pairs from their other ends.
inline constexpr std::array<std::array<int, 2>, 4> kPairOffsets = {{{1, 0}, {0, 1}, {1, 1}, {-1, 1}}};

/// Pixels before and after each row that kernels may read.
inline constexpr int kRowPadding = 16;

/// What guide weights compare, for one row of pixels.
struct SurfaceRow {
  const float *disparity, *dx, *dy; ///< dx, dy: change of the disparity per pixel
  const int16_t *nx, *ny, *nz;      ///< in kNormalUnit
};

/// Least guide weight, of 255, of two pixels that both hit something.
inline constexpr uint8_t kMinGuide = 3;

struct GuideTerms {
  float depth, slope;
};

/// Weights of the pairs that begin in one row, by kPairOffsets.
using PairRow = std::array<const uint8_t*, 4>;

/// Values of a pass in one row, with their variances.
struct NoisyRow {
  const float *value, *variance;
};

/// Values of a pass at the row of a pixel and at the rows of its neighbours, one step above and below.
struct PassRows {
  const float *value, *value_above, *value_below;
  const float *variance, *variance_above, *variance_below;
  const float *scale, *scale_above, *scale_below; ///< 1 / D
  PairRow here, above;                            ///< pairs that begin in the row, and in the row one step above
};

/// Moments of the pixels of one row, or of windows; all 0 for pixels without history.
struct MomentRows {
  float *seen, *value, *square; ///< 1, a, a^2
  float *spread_seen, *spread;  ///< 1 and s2, of pixels with at least two samples
  float *decay_seen, *decay;    ///< 1 and Trend::decay, of pixels that have one
};

/// Side in pixels of the window for the variance.
inline constexpr int kMomentWindow = 5;
using MomentWindow = std::array<MomentRows, kMomentWindow>;

struct VarianceTerms {
  float prior = 0; ///< weight of the window's variance in frames
  /// Variance of a mean times n / s2: still_factor n^-still_power if still, moving_base + moving_gain n if moving.
  float still_factor = 1, still_power = 0, moving_base = 1, moving_gain = 0, longest_moving = 0;
  float ratio_prior = 1; ///< weight of still_factor against the window's trends, in pixels
  float young = 0;       ///< the filter is told 1 + young / n + distrust / n^2 times the variance of n frames
  float distrust = 0;
  bool moving = false, stratified = false;
};

/// Functions on rows of pixels; docs/denoiser.md has the formulas. Rows are readable up to kRowPadding pixels outside
/// [0, width), unless stated otherwise.
struct FilterKernels {
  /// Guide weights of the pairs that begin in a row: kMinGuide to 255 where both pixels hit, 0 where one does not.
  /// @param below the row one step below
  void (*guide)(int width, int step, const SurfaceRow& here, const SurfaceRow& below, const GuideTerms& terms,
                const std::array<uint8_t*, 4>& weights);
  /// Distances d of the pairs that begin in a row: 0 for noise, from -1 / tolerance on; 0 where the guide weight is 0.
  /// @param below the row one step below
  void (*compare)(int width, int step, const NoisyRow& here, const NoisyRow& below, const PairRow& guide,
                  float tolerance, const std::array<float*, 4>& distance);
  /// Weights of pairs from the distances of three rows.
  /// @param column scratch
  void (*weigh)(int width, const std::array<const float*, 3>& distance, const uint8_t* guide, float limit,
                float* column, uint8_t* weights);
  /// 1 / D. @param samples frames of history, for the pass in which lone samples give way; else null
  void (*normalise)(int width, int step, const PairRow& here, const PairRow& above, const float* samples, float* scale);
  /// Moves AO between the pixels of pairs.
  void (*exchange)(int width, int step, const PassRows& rows, float* value, float* variance);
  /// Moments of single pixels.
  void (*moments)(int width, const float* mean, const float* square, const float* samples, const uint32_t* trend,
                  const MomentRows& out);
  /// Sums of kMomentWindow pixels along x.
  void (*sum_along_row)(int width, const float* in, float* out);
  /// Variance of the mean of each pixel.
  /// @param window sums along x of the rows of the pixel's window
  /// @param estimate the expected variance; 0 without history
  /// @param variance what the filter is told: larger while there are few frames, and the maximum without history
  void (*variance)(int width, const float* mean, const float* square, const float* samples, const MomentWindow& window,
                   const VarianceTerms& terms, float* estimate, float* variance);
  /// Whether a pixel that hit something has no history.
  bool (*any_to_fill)(int width, const float* disparity, const float* samples);
  /// Writes a row of the result: AO, or kInvalidAo for misses, and the lengths of histories.
  void (*finish)(int width, const float* value, const float* disparity, const float* samples, float* ao, float* tspp);
};

/// Returns the kernels of an instruction set. All give the same bits. Throws Error(kUnsupported) if this machine lacks
/// it.
const FilterKernels& filter_kernels(Isa isa);

} // namespace packtrace
