#pragma once

// Compiled once per instruction set. Everything is local to the file that includes it, so that no function of a wider
// instruction set replaces another file's.

#include <array>
#include <utility>

#include "runtime/denoise/kernels/history_rows.h"
#include "runtime/denoise/kernels/resample_rows_body.h"
#include "runtime/denoise/kernels/row_math.h"
#include "runtime/denoise/kernels/units.h"

namespace packtrace {
namespace {

void unpack_row(int width, const uint16_t* moments, float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] = moment_of(moments[x]);
}

void accumulate_row(int width, const float* ao, const float* disparity, const HistoryLengths& longest,
                    const PastRow& past, const HistoryRow& history, const SampleRow& samples) {
  const PastRow p = past;
  const HistoryRow h = history;
  const HistoryLengths most = longest;
  const SampleRow o = samples;
  const F32 one = all(1.0f), nothing{};
  for (int x = 0; x < width; x += kFloats) {
    const int count = width - x;
    const F32 sample = load_first(count, ao + x), frames = load_first(count, p.samples + x);
    const I32 valid = both(both(sample >= 0.0f, sample <= kLargest), load(disparity + x) > 0.0f);
    const F32 value = select(valid, lesser(sample, one), nothing);
    const F32 n = lesser(frames + 1.0f, all(most.slow)), each = 1.0f / n;
    const F32 share = select(valid, each, nothing);
    const F32 fast_share = select(valid, greater(each, all(1.0f / most.fast)), nothing);
    const F32 old_mean = load_first(count, p.mean + x), old_fast = load_first(count, p.fast + x);
    const F32 old_square = load_first(count, p.square + x);
    const F32 mean = old_mean + (value - old_mean) * share, fast = old_fast + (value - old_fast) * fast_share;
    store_first(count, h.mean + x, mean);
    store_first_words(count, h.square + x, in_moment_units(old_square + (value * value - old_square) * share));
    store_first_words(count, h.fast + x, in_moment_units(fast));
    store_first(count, h.samples + x, select(valid, n, lesser(frames, all(most.slow))));
    const I32 units = truncated(value * kSampleUnits + 0.5f);
    store_first(count, o.value + x, valid ? units + (1 << kCountShift) : I32{});
    store_first(count, o.square + x, truncated(value * value * kSampleUnits + 0.5f));
    store_first(count, o.change + x, truncated(select(valid, fast - mean, nothing) * kSampleUnits));
  }
}

void keep_trends_row(int width, const float* motion, const float* samples, const float* weights, uint32_t* trend) {
  for (int x = 0; x < width; x += kFloats) {
    const I32 kept = both(load(samples + x) > 1.0f, load(weights + x) > kLostWeight);
    const I32 still = both(kept, Motion(width - x, motion + 2 * x).still);
    store_first(width - x, trend + x, still & load(trend + x));
  }
}

int next_crossing(int x, int width, const int32_t* values, const float* samples, float longest) {
  return first_lane(x, width, [=](int at) {
    const F32 n = load(samples + at);
    const I32 crosses = n - (F32)((I32)n & 0x7f800000) < 1.0f; // crosses_power_of_two()
    return both(both(crosses, n < longest), load(values + at) > 0);
  });
}

template <int kRadius>
void sum_windows(int width, const SampleRow& samples, const WindowSums& sums, const WindowRow& windows) {
  const auto sum = [width](const int32_t* in, int32_t* along_x, int32_t* window, int32_t* narrow) {
    for (int x = 0; x < width; x += kFloats) {
      I32 total = load(in + x) + (load(in + x - 1) + load(in + x + 1));
      if (narrow != nullptr) store(narrow + x, total);
      for (int r = 2; r <= kRadius; ++r) total += load(in + x - r) + load(in + x + r);
      store(window + x, load(window + x) + (total - load(along_x + x)));
      store(along_x + x, total);
    }
  };
  sum(samples.value, sums.value, windows.value, sums.narrow_value);
  sum(samples.square, sums.square, windows.square, nullptr);
  sum(samples.change, sums.change, windows.change, sums.narrow_change);
}

/// Reduces the magnitude of `change` by `limit`, at most to 0 (soft threshold).
inline F32 excess(F32 change, F32 limit) {
  const F32 left = greater(magnitude(change) - limit, F32{});
  return select(change < 0.0f, -left, left);
}

/// Statistics of the windows around the pixels of a vector.
struct Windows {
  F32 count, narrow_count; ///< at least 1
  F32 change, narrow_change;
  F32 sum, squares;

  Windows(const WindowRow& w, int x) {
    const auto of_rows = [x](const std::array<const int32_t*, 3>& rows) {
      return load(rows[0] + x) + load(rows[1] + x) + load(rows[2] + x);
    };
    const auto in_floats = [](I32 units) { return as_floats(units) * (1.0f / kSampleUnits); };
    const auto count_of = [](I32 values) { return greater(as_floats((values >> kCountShift) & 127), all(1.0f)); };
    const I32 values = load(w.value + x);
    count = count_of(values), narrow_count = count_of(of_rows(w.narrow_value));
    sum = in_floats(values & ((1 << kCountShift) - 1)), squares = in_floats(load(w.square + x));
    change = in_floats(load(w.change + x)), narrow_change = in_floats(of_rows(w.narrow_change));
  }

  /// Whether correction() might not be 0: its test, multiplied by count (count - 1), without divisions and roots. The
  /// least variance and the factors 0.999 allow for their roundings.
  bool may_change(const CorrectTerms& t) const {
    const F32 least = greater(count * squares * (1.0f - 4e-6f) - sum * sum, F32{});
    const F32 noise = (t.gamma * t.gamma * t.fast_share * 0.999f) * least, others = greater(count - 1.0f, all(1.0f));
    const auto squared = [](F32 excess_change) { return excess_change * excess_change; };
    const F32 wide = greater(magnitude(change) - t.tolerance * 0.999f * count, F32{});
    const F32 narrow = greater(magnitude(narrow_change) - t.tolerance * 0.999f * narrow_count, F32{});
    return any_greater(squared(wide) * others, noise) ||
           any_greater(squared(narrow) * others * count, noise * narrow_count);
  }

  /// The part of the change that noise does not explain, which is added to the mean.
  F32 correction(const CorrectTerms& t) const {
    const F32 spread = squares - sum * (sum / count);
    const F32 variance = select(count > 1.0f, greater(spread, F32{}) / greater(count - 1.0f, all(1.0f)), F32{});
    const F32 noise = variance * t.fast_share;
    const F32 wide = excess(change / count, t.gamma * root(noise / count) + t.tolerance);
    const F32 narrow = excess(narrow_change / narrow_count, t.gamma * root(noise / narrow_count) + t.tolerance);
    return select(magnitude(narrow) > magnitude(wide), narrow, wide);
  }
};

void correct_row(int width, const WindowRow& windows, const CorrectTerms& terms, const HistoryRow& history,
                 uint32_t* trend) {
  const CorrectTerms t = terms;
  const HistoryRow h = history;
  for (int x = 0; x < width; x += kFloats) {
    const Windows around(windows, x);
    if (!around.may_change(t)) continue;
    const int count = width - x;
    const F32 frames = load(h.samples + x), old_mean = load(h.mean + x);
    const F32 wanted = lesser(greater(old_mean + around.correction(t), F32{}), all(1.0f));
    const F32 new_mean = select(frames > 0.0f, wanted, old_mean), shift = new_mean - old_mean;
    const F32 kept = 1.0f - lesser(t.response * magnitude(shift), all(1.0f));
    const I32 old_square = load_wide(h.square + x);
    const F32 spread = greater(moments_of(old_square) - old_mean * old_mean, F32{}); // a shift keeps the variance
    const I32 same = shift == 0.0f, square = in_moment_units(spread + new_mean * new_mean);
    store_first(count, h.mean + x, new_mean);
    store_first_words(count, h.square + x, same ? old_square : square);
    store_first(count, h.samples + x, lesser(frames, greater(frames * kept, all(t.fast_frames))));
    store_first(count, trend + x, same ? load(trend + x) : I32{});
  }
}

template <int... kPowers>
constexpr HistoryKernels history_table(std::integer_sequence<int, kPowers...>) {
  return {locate_row,
          {resample_run<kPowers>...},
          {look_nearby<kPowers>...},
          next_run,
          next_lost,
          unpack_row,
          accumulate_row,
          keep_trends_row,
          next_crossing,
          {nullptr, sum_windows<1>, sum_windows<2>, sum_windows<3>, sum_windows<4>},
          correct_row};
}

constexpr HistoryKernels kHistoryRows = history_table(std::make_integer_sequence<int, kMaxNormalSquarings + 1>());

} // namespace
} // namespace packtrace
