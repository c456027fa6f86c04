#include "runtime/denoise/temporal_blend.h"

#include <cmath>
#include <limits>

#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

struct AccumulateRow {
  const float *ao, *disparity;
  float *mean, *square, *fast, *samples, *out_ao, *out_valid, *out_change;
};

PACKTRACE_AVX2_CLONES
void accumulate_row(int width, const AccumulateRow& rows, float longest, float fast_frames) {
  const AccumulateRow r = rows;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const bool valid = (r.ao[x] >= 0.0f) & (r.ao[x] <= std::numeric_limits<float>::max()) & (r.disparity[x] > 0.0f);
    const float value = valid ? smaller(r.ao[x], 1.0f) : 0.0f;
    const float count = smaller(r.samples[x] + 1.0f, longest);
    const float share = valid ? 1.0f / count : 0.0f;
    const float fast_share = valid ? 1.0f / smaller(count, fast_frames) : 0.0f;
    const float new_mean = r.mean[x] + (value - r.mean[x]) * share;
    const float new_fast = r.fast[x] + (value - r.fast[x]) * fast_share;
    r.mean[x] = new_mean;
    r.square[x] += (value * value - r.square[x]) * share;
    r.fast[x] = new_fast;
    r.samples[x] = valid ? count : smaller(r.samples[x], longest);
    r.out_ao[x] = value;
    r.out_valid[x] = valid ? 1.0f : 0.0f;
    r.out_change[x] = valid ? new_fast - new_mean : 0.0f;
  }
}

/// Reduces the magnitude of `change` by `limit`, at most to 0 (soft threshold).
inline float excess(float change, float limit) { return std::copysign(larger(std::abs(change) - limit, 0.0f), change); }

struct CorrectRow {
  const float *count, *local_variance, *change, *narrow_count, *narrow_change;
  float *mean, *square, *samples;
};

struct CorrectScales {
  float fast_share; ///< variance of the fast history divided by the variance of a sample
  float gamma, tolerance, response, fast_frames;
};

PACKTRACE_AVX2_CLONES
void correct_row(int width, const CorrectRow& rows, CorrectScales s) {
  const CorrectRow r = rows;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float noise = r.local_variance[x] * s.fast_share;
    const float wide = excess(r.change[x], s.gamma * std::sqrt(noise / larger(r.count[x], 1.0f)) + s.tolerance);
    const float narrow =
        excess(r.narrow_change[x], s.gamma * std::sqrt(noise / larger(r.narrow_count[x], 1.0f)) + s.tolerance);
    const float wanted = std::abs(narrow) > std::abs(wide) ? narrow : wide;
    const float old_mean = r.mean[x];
    const float new_mean = r.samples[x] > 0.0f ? smaller(larger(old_mean + wanted, 0.0f), 1.0f) : old_mean;
    const float shift = new_mean - old_mean;
    const float kept = 1.0f - smaller(s.response * std::abs(shift), 1.0f);
    const float n = smaller(r.samples[x], larger(r.samples[x] * kept, s.fast_frames));
    const float moment = larger(r.square[x] - old_mean * old_mean, 0.0f); // a shift keeps the variance
    r.mean[x] = new_mean;
    r.square[x] = moment + new_mean * new_mean;
    r.samples[x] = n;
  }
}

} // namespace

void accumulate(std::span<const float> ao, const Guides& guides, const FluxConfig& config, History& history,
                FrameSamples& samples) {
  const float longest = static_cast<float>(config.max_tspp), fast_frames = static_cast<float>(config.fast_frames);
  for_row_blocks(guides.size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const AccumulateRow row{&ao[static_cast<size_t>(y) * guides.size.width],
                              guides.disparity.row(y),
                              history.mean.row(y),
                              history.square.row(y),
                              history.fast.row(y),
                              history.samples.row(y),
                              samples.ao.row(y),
                              samples.valid.row(y),
                              samples.change.row(y)};
      accumulate_row(static_cast<int>(guides.size.width), row, longest, fast_frames);
    }
  });
}

void correct_history(const FrameSamples& samples, const Guides& guides, const FluxConfig& config, History& history) {
  const float share = 1.0f / static_cast<float>(config.fast_frames);
  const CorrectScales scales{share / (2.0f - share), config.change_gamma, config.change_tolerance,
                             config.change_response, static_cast<float>(config.fast_frames)};
  tbb::enumerable_thread_specific<LocalStatisticsRows> statistics(guides.size.width, config.window);
  for_row_blocks(guides.size.height, [&](int first, int last) {
    LocalStatisticsRows& rows = statistics.local();
    rows.begin(samples, first);
    for (int y = first; y < last; ++y) {
      const LocalStatistics& local = rows.at(samples, y);
      const CorrectRow row{local.count.data(),        local.variance.data(),      local.change.data(),
                           local.narrow_count.data(), local.narrow_change.data(), history.mean.row(y),
                           history.square.row(y),     history.samples.row(y)};
      correct_row(static_cast<int>(guides.size.width), row, scales);
    }
  });
}

} // namespace packtrace
