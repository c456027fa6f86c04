#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "pbrt_import/base/isa.h"

namespace packtrace {

/// Pixels after each row of scratch that kernels may write: as many as fill a vector of the narrowest type.
inline constexpr int kRunPadding = 32;

/// Offset of a pixel without history, in LocatedRow.
inline constexpr int32_t kNoOffset = INT32_MIN;

/// History with a smaller total weight is rejected: the tests' soft weights let hardly any of the surface through.
inline constexpr float kMinHistoryWeight = 1e-3f;

/// Histories with at most this total weight are lost. Those of nearby pixels replace them.
inline constexpr float kLostWeight = 0.2f;

/// Nearby pixels are those in a square of 2 kNearbyRadius + 1 pixels around the footprint's nearest pixel. Their
/// weights fall to 0 at the distance kNearbyReach.
inline constexpr int kNearbyRadius = 2;
inline constexpr float kNearbyReach = 3.0f;

/// Footprints with a smaller total weight cross an edge, where sharpening would overshoot.
inline constexpr float kMinSharpenWeight = 0.9f;

/// One row of a frame, as reprojection reads it.
struct MovingRow {
  const float *above, *here, *below; ///< disparity of three rows
  const float* motion;               ///< x and y of each pixel's motion in pixels
  const float* previous_z;           ///< null: as now
};

struct LocateTerms {
  float depth, slope; ///< of the tolerance of disparities
  float y, width, height;
  ptrdiff_t stride; ///< between rows of the previous frame
  float longest_still, longest_moving;
};

/// Where the pixels of a row were in the previous frame.
struct LocatedRow {
  int32_t* offset;                ///< of the first of the 2 x 2 pixels around it from the pixel itself; or kNoOffset
  float *fraction_x, *fraction_y; ///< in [0, 1)
  float *disparity, *tolerance;   ///< of the surface, in the previous frame; disparity 0: no history
  float* longest;                 ///< longest history in frames
};

/// Pixels up to `end` that moved by the same offset; those without history belong to any run.
struct Run {
  int end;
  int32_t offset; ///< kNoOffset if all are without history
};

/// What becomes of histories from nearby pixels.
struct NearbyTerms {
  float share;   ///< of their length that is kept
  float longest; ///< in frames
};

/// The planes of the previous frame, at a pixel.
struct PreviousPixels {
  const float* disparity;
  const int16_t *normal_x, *normal_y, *normal_z; ///< in kNormalUnit
  const uint32_t* instance;
  const float *mean, *samples;
  const uint16_t *square, *fast; ///< in units of 1 / kMomentUnits
  ptrdiff_t stride;
};

/// The surfaces that history must match.
struct WantedRow {
  LocatedRow at;
  const int16_t *normal_x, *normal_y, *normal_z;
  const uint32_t* instance;
};

/// One row of the history.
struct HistoryRow {
  float *mean, *samples;
  uint16_t *square, *fast; ///< in units of 1 / kMomentUnits
};

/// One row of the history before a frame is added to it.
struct PastRow {
  float *mean, *square, *fast, *samples;
};

/// Longest histories in frames.
struct HistoryLengths {
  float slow, fast;
};

/// Samples, and sums of them, are whole numbers in units of 2^-17, so that sums over windows can follow from those of
/// the windows above: sums of values have the number of samples above kCountShift bits.
inline constexpr float kSampleUnits = 131072.0f;
inline constexpr int kCountShift = 24;

/// One row of a frame's samples. Pixels without a sample and those outside the image are 0.
struct SampleRow {
  int32_t* value;  ///< AO clamped to [0, 1], and 1 << kCountShift where the pixel has a sample
  int32_t* square; ///< of the AO
  int32_t* change; ///< fast minus slow history, both including this sample
};

/// Sums along x over the window, or over 3 pixels (narrow).
struct WindowSums {
  int32_t *value, *square, *change, *narrow_value, *narrow_change;
};

/// Sums over the windows of the pixels of one row; for windows of 3 x 3 pixels those of three rows.
struct WindowRow {
  int32_t *value, *square, *change;
  std::array<const int32_t*, 3> narrow_value, narrow_change;
};

struct CorrectTerms {
  float fast_share; ///< variance of the fast history divided by the variance of a sample
  float gamma, tolerance, response, fast_frames;
};

inline constexpr int kMaxWindowRadius = 4;
inline constexpr int kMaxNormalSquarings = 10;

/// Functions on rows of pixels that update the history; docs/denoiser.md describes the passes.
struct HistoryKernels {
  /// Finds the previous positions of the pixels of a row.
  void (*locate)(int width, const MovingRow& row, const LocateTerms& terms, const LocatedRow& located);
  /// Resamples the history of `width` pixels that moved by the same offset, by the number of squarings that raise
  /// cosines to their power. Writes up to kRunPadding pixels more.
  /// @param from the previous frame at the first pixel plus its offset
  /// @param weights scratch
  std::array<void (*)(int width, const PreviousPixels& from, const WantedRow& wanted, bool test_instances,
                      const PastRow& out, float* weights),
             kMaxNormalSquarings + 1>
      resample;
  /// Replaces the history of pixel x by the weighted mean of those of the surface's nearby pixels, if there are any; by
  /// the number of squarings.
  /// @param from the previous frame at the beginning of the row plus the pixel's offset
  std::array<void (*)(int x, const PreviousPixels& from, const WantedRow& wanted, bool test_instances,
                      const NearbyTerms& terms, const PastRow& out),
             kMaxNormalSquarings + 1>
      look_nearby;
  /// The run of pixels from x on.
  /// @param offsets LocatedRow::offset, followed by kRunPadding pixels
  Run (*next_run)(int x, int width, const int32_t* offsets);
  /// The first pixel from x on, before `width`, that lost its history; or `width`.
  /// @param weights total weight of each pixel in its resampled footprint, as resample() leaves it
  int (*next_lost)(int x, int width, const float* weights, const float* disparity);
  /// Converts a row of moments from units of 1 / kMomentUnits.
  void (*unpack)(int width, const uint16_t* moments, float* out);
  /// Adds samples to a row of the history, perhaps in place.
  void (*accumulate)(int width, const float* ao, const float* disparity, const HistoryLengths& longest,
                     const PastRow& past, const HistoryRow& history, const SampleRow& samples);
  /// Trends of a resampled row, in place: pixels that did not move keep theirs, unless their history was lost.
  /// @param motion x and y of each pixel's motion in pixels
  /// @param weights total weight of each pixel in its resampled footprint, as resample() leaves it
  void (*keep_trends)(int width, const float* motion, const float* samples, const float* weights, uint32_t* trend);
  /// The first pixel from x on, before `width`, whose sample made its history, shorter than `longest`, reach or cross a
  /// power of two; or `width`.
  int (*next_crossing)(int x, int width, const int32_t* values, const float* samples, float longest);
  /// Sums along x, by the window's radius, and lets the windows follow. Samples are read up to the radius outside the
  /// row.
  /// @param sums in: of the row that leaves the windows; out: of the row that enters them
  std::array<void (*)(int width, const SampleRow& samples, const WindowSums& sums, const WindowRow& windows),
             kMaxWindowRadius + 1>
      sum;
  /// Corrects a row of the history in place. Trends of corrected pixels become unknown.
  /// @param windows followed by kRunPadding pixels, as are all rows of sums
  void (*correct)(int width, const WindowRow& windows, const CorrectTerms& terms, const HistoryRow& history,
                  uint32_t* trend);
};

/// Returns the kernels of an instruction set. All give the same bits. Throws Error(kUnsupported) if this machine lacks
/// it.
const HistoryKernels& history_kernels(Isa isa);

} // namespace packtrace
