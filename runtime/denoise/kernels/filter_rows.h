#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "pbrt_import/base/isa.h"

namespace packtrace {

/// Offsets (x, y) of the pairs of pixels that a filter pass compares, in units of its step. The other four neighbours
/// are the same pairs from their other ends.
inline constexpr std::array<std::array<int, 2>, 4> kPairOffsets = {{{1, 0}, {0, 1}, {1, 1}, {-1, 1}}};

/// Pixels before and after each row of 16-bit values that kernels may read, and after which they may write.
inline constexpr int kRowPadding = 64;

/// The passes compute in integers of 16 bits, so that a vector holds twice as many pixels as with floats. AO is stored
/// in units of 1 / kAoUnits; eight roundings still fit.
inline constexpr int kAoUnits = 32700;
inline int16_t in_ao_units(float ao) {
  const float bounded = ao > 0.0f ? (ao < 1.0f ? ao : 1.0f) : 0.0f;
  return static_cast<int16_t>(static_cast<int>(bounded * float{kAoUnits} + 0.5f));
}
/// Precisions, 1 / sqrt(2 noise_tolerance v + 1e-6) for a variance of v, are stored in units of 1 / kPrecisionUnits;
/// those of pixels that hit something are at least 1 unit, and 0 means a miss. 1.375 times the largest one fits.
inline constexpr float kPrecisionUnits = 47.0f;

inline constexpr float kMaxPrecision = 1000.0f * kPrecisionUnits;

/// 0.707 and 0.499 in units of 2^-16, per unit of a guide weight.
inline constexpr uint16_t kStraight = 182, kDiagonal = 128;
/// A sample unlike all its neighbours loses the weight kLoneBase + kLoneYoung / n, where n is the number of samples.
inline constexpr float kLoneBase = 0.7f, kLoneYoung = 0.3f;
inline constexpr float kMaxVariance = 0.25f; ///< of values in [0, 1]
/// In units of 1 / kPrecisionUnits; the sum of nine squares fits.
inline constexpr uint16_t kMaxDeviations = 240;

/// What guide weights compare, for one row of pixels.
struct SurfaceRow {
  const float* disparity;
  std::array<const float*, 4> rise; ///< change of the disparity along each of kPairOffsets
  /// Normals in kNormalUnit as pairs of signed 16-bit numbers: x in the lower and y in the upper half; z and 0.
  const uint32_t *normal_xy, *normal_z;
};

/// Least guide weight, of 255, of two pixels that both hit something.
inline constexpr uint8_t kMinGuide = 2;

/// Least guide weight of two pixels without any neighbour on their surfaces, as in foliage: there is no edge to keep
/// there, and the noise of few samples is larger than the differences of neighbours.
inline constexpr uint8_t kLoneGuide = 17;
/// Sum of the guide weights of a pixel's eight neighbours from which on it is not alone.
inline constexpr int kCompany = 3 * 255;

/// Largest share of GuideTerms::bend in the tolerance, in units of that of GuideTerms::depth.
inline constexpr float kMaxBend = 5.0f;

struct GuideTerms {
  float depth, slope, bend;
};

/// Guide weights of the pairs that begin in one row, in units of 1/255.
using PairRow = std::array<const uint8_t*, 4>;

/// Weights w of the pairs that begin in one row, in units of 2^-16.
using WeightRow = std::array<const uint16_t*, 4>;

/// Distances of pairs of one of kPairOffsets in three rows.
using DistanceRows = std::array<const uint16_t*, 3>;

/// Values of a pass in one row, with their precisions.
struct NoisyRow {
  const int16_t* value;
  const uint16_t* precision;
};

/// Values of a pass at the row of a pixel and at the rows of its neighbours, one step above and below.
struct PassRows {
  const int16_t *value, *value_above, *value_below;
  const uint16_t* precision;
  const uint16_t *scale, *scale_above, *scale_below; ///< 1 / D
  WeightRow here, above;                             ///< pairs that begin in the row, and in the row one step above
};

/// Squared deviations are stored in this many units.
inline constexpr float kDistanceUnits = kPrecisionUnits * kPrecisionUnits / 8.0f;

/// What weighs patches.
struct PatchTerms {
  uint16_t no_distance; ///< distance 0 in the units of compare()
  int shift;            ///< distances of patches, times 2^shift, have their limit at
  uint16_t limit;       ///< this, between 2^15 and 2^16
  uint16_t stretch;     ///< 2^16 (2^16 - 1) / limit - 2^16
};

/// Moments of the pixels of one row, or of windows; all 0 for pixels without history.
struct MomentRows {
  /// Numbers of pixels: of all, 32 times of those with at least two samples, and 1024 times of those with Trend::decay.
  float* counts;
  float *value, *square; ///< a, a^2
  float *spread, *decay; ///< s2 of at least two samples, Trend::decay
};

/// Side in pixels of the window for the variance.
inline constexpr int kMomentWindow = 5;
using MomentWindow = std::array<MomentRows, kMomentWindow>;

/// The history of a row, and where its camera rays hit something.
struct HistoryOfRow {
  const float *mean, *samples, *disparity;
  const uint16_t* square; ///< in units of 1 / kMomentUnits
};

/// Input of the first pass.
struct FirstRow {
  int16_t* value;
  uint16_t* precision; ///< lower while there are few frames, and the lowest without history
  uint16_t* lone;      ///< weight that a sample unlike all its neighbours loses, in units of 2^-13
};

struct VarianceTerms {
  float tolerance = 2; ///< noise_tolerance
  float prior = 0;     ///< weight of the window's variance in frames
  /// Variance of a mean times n / s2: still_factor n^-still_power if still, moving_base + moving_gain n if moving.
  float still_factor = 1, still_power = 0, moving_base = 1, moving_gain = 0, longest_moving = 0;
  float ratio_prior = 1; ///< weight of still_factor against the window's trends, in pixels
  /// 1 / N, where each frame's value is the mean of N samples. The filter assumes 1 + young / (N n) + distrust / (N
  /// n)^2 times the variance of n frames.
  float per_sample = 1, young = 0, distrust = 0;
  /// If N > 1, the variance of a value is at most most_spread m (1 - m) around a mean of m, since samples are between 0
  /// and 1; what varies more is the occlusion itself.
  float most_spread = 1;
  bool moving = false, stratified = false;
};

/// Functions on rows of pixels; docs/denoiser.md has the formulas. Rows are readable up to kRowPadding pixels outside
/// [0, width), unless stated otherwise.
struct FilterKernels {
  /// Guide weights of the pairs that begin in a row: kMinGuide to 255 where both pixels hit, 0 where one does not.
  /// @param below the row one step below
  /// @param weights followed by kRowPadding pixels, into which zeros may be written
  void (*guide)(int width, int step, const SurfaceRow& here, const SurfaceRow& below, const GuideTerms& terms,
                const std::array<uint8_t*, 4>& weights);
  /// How alone the pixels of a row are, from the guide weights of the pairs one pixel apart that begin in it and in the
  /// row above: 0 to kLoneGuide. 0 for pixels that missed.
  void (*lone_guide)(int width, const PairRow& here, const PairRow& above, const float* disparity, uint8_t* lone);
  /// Raises the guide weights of the pairs that begin in a row to the lesser lone_guide() of both pixels.
  /// @param here, below lone_guide() of the row and of that one step below
  void (*raise_guides)(int width, int step, const PairRow& weights, const uint8_t* here, const uint8_t* below,
                       const std::array<uint8_t*, 4>& raised);
  /// Distances d of the pairs that begin in a row, plus 1 / noise_tolerance; kNoDistance where a pixel missed.
  /// @param below the row one step below
  /// @param no_distance PatchTerms::no_distance
  void (*compare)(int width, int step, const NoisyRow& here, const NoisyRow& below, uint16_t no_distance,
                  const std::array<uint16_t*, 4>& distance);
  /// Weights of pairs from the distances of three rows.
  /// @param guide_stride from a guide to that of the next row, which is fetched into the cache
  /// @param columns scratch
  void (*weigh)(int width, const std::array<DistanceRows, 4>& distance, const PairRow& guide, ptrdiff_t guide_stride,
                const PatchTerms& terms, const std::array<uint16_t*, 4>& columns,
                const std::array<uint16_t*, 4>& weights);
  /// 1 / D in units of 2^-15. The first pass, in which lone samples give way, has units of 2^-13.
  /// @param lone k of the pixels in units of 2^-13
  void (*normalise)(int width, int step, const WeightRow& here, const WeightRow& above, uint16_t* scale);
  void (*normalise_first)(int width, int step, const WeightRow& here, const WeightRow& above, const uint16_t* lone,
                          uint16_t* scale);
  /// Moves AO between the pixels of pairs. The last pass, which may be the first one, leaves the precisions alone.
  using Exchange = void(int width, int step, const PassRows& rows, int16_t* value, uint16_t* precision);
  Exchange *exchange, *exchange_first, *exchange_last, *exchange_only;
  /// Moments of single pixels.
  void (*moments)(int width, const float* mean, const uint16_t* square, const float* samples, const uint32_t* trend,
                  const MomentRows& out);
  /// Sums of kMomentWindow pixels along x.
  void (*sum_along_row)(int width, const float* in, float* out);
  /// Variance of the mean of each pixel.
  /// @param window sums along x of the rows of the pixel's window
  /// @param estimate the expected variance; 0 without history
  void (*variance)(int width, const HistoryOfRow& history, const MomentWindow& window, const VarianceTerms& terms,
                   float* estimate, const FirstRow& first);
  /// Whether a pixel that hit something has no history.
  bool (*any_to_fill)(int width, const float* disparity, const float* samples);
  /// Writes a row of the result: AO, or kInvalidAo for misses, and the lengths of histories.
  /// @param mean of the history; AO differs from it by what the passes moved
  /// @param ao contains the AO that pixels without history started from
  void (*finish)(int width, const int16_t* value, const float* mean, const float* disparity, const float* samples,
                 float* ao, float* tspp);
};

/// Returns the kernels of an instruction set. All give the same bits. Throws Error(kUnsupported) if this machine lacks
/// it.
const FilterKernels& filter_kernels(Isa isa);

} // namespace packtrace
