#pragma once

// Compiled once per instruction set. Everything is local to the file that includes it, so that no function of a wider
// instruction set replaces another file's.

#include <cmath>
#include <limits>
#include <utility>

#include "runtime/denoise/kernels/history_rows.h"
#include "runtime/denoise/kernels/row_math.h"
#include "runtime/denoise/kernels/units.h"

namespace packtrace {
namespace {

constexpr float kLargest = std::numeric_limits<float>::max(), kSmallest = std::numeric_limits<float>::min();

/// Magnitude of the smaller one-sided difference (DepthDerivatives).
inline float smaller_step(float before, float centre, float after) {
  const float backward = std::abs(centre - before), forward = std::abs(after - centre);
  const float b = before > 0.0f ? backward : kLargest, f = after > 0.0f ? forward : kLargest;
  const float least = lesser(b, f);
  return ((before > 0.0f) | (after > 0.0f)) & (centre > 0.0f) ? least : 0.0f;
}

template <bool kMovedInDepth>
void locate_pixels(int width, const MovingRow& row, const LocateTerms& terms, const LocatedRow& located) {
  const MovingRow r = row;
  const LocateTerms t = terms;
  const LocatedRow o = located;
  const float *above = r.above, *here = r.here, *below = r.below;
  const int stride = static_cast<int>(t.stride), row_y = static_cast<int>(t.y);
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float mx = r.motion[2 * x], my = r.motion[2 * x + 1];
    const bool still = (std::abs(mx) <= kStillMotion) & (std::abs(my) <= kStillMotion);
    const float from_x = static_cast<float>(x) - (still ? 0.0f : mx), from_y = t.y - (still ? 0.0f : my);
    const float now = here[x];
    float before = now;
    bool seen = now > 0.0f;
    if constexpr (kMovedInDepth) {
      const float z = r.previous_z[x];
      seen &= (z >= kNearestDepth) & (z <= kFarthestDepth);
      before = 1.0f / lesser(greater(z, kNearestDepth), kFarthestDepth);
    }
    // False for NaN, too. The conversions to integers below cannot overflow.
    const bool inside = (from_x > -1.0f) & (from_x < t.width) & (from_y > -1.0f) & (from_y < t.height) & seen;
    const float at_x = inside ? from_x : 0.0f, at_y = inside ? from_y : 0.0f;
    int column = static_cast<int>(at_x), line = static_cast<int>(at_y);
    column -= static_cast<float>(column) > at_x ? 1 : 0; // towards minus infinity
    line -= static_cast<float>(line) > at_y ? 1 : 0;
    float slope = smaller_step(here[x - 1], now, here[x + 1]) + smaller_step(above[x], now, below[x]);
    if constexpr (kMovedInDepth) slope *= before / greater(now, kSmallest);
    o.offset[x] = inside ? (line - row_y) * stride + (column - x) : kNoOffset;
    o.fraction_x[x] = at_x - static_cast<float>(column);
    o.fraction_y[x] = at_y - static_cast<float>(line);
    o.disparity[x] = inside ? before : 0.0f;
    o.tolerance[x] = t.depth * before + t.slope * slope + kSmallest;
    o.longest[x] = still ? t.longest_still : t.longest_moving;
  }
}

void locate_row(int width, const MovingRow& row, const LocateTerms& terms, const LocatedRow& located) {
  (row.previous_z != nullptr ? locate_pixels<true> : locate_pixels<false>)(width, row, terms, located);
}

/// The difference between Catmull-Rom and linear interpolation between a and b, where before and after are the outer
/// neighbours: -t (1 - t) / 2 times the linearly interpolated second differences at a and b.
/// Source: R. Keys, "Cubic convolution interpolation for digital image processing", 1981, a = -1/2.
inline F32 sharpening(F32 before, F32 a, F32 b, F32 after, F32 t) {
  return -0.5f * t * (1.0f - t) * ((1.0f - t) * (before - 2.0f * a + b) + t * (a - 2.0f * b + after));
}

/// The surface that the history of some pixels must show.
struct WantedSurfaces {
  F32 disparity, tolerance;
  I32 nx, ny, nz, instance;

  WantedSurfaces(const WantedRow& w, int x)
      : disparity(load(w.at.disparity + x)), tolerance(load(w.at.tolerance + x)), nx(load_wide(w.normal_x + x)),
        ny(load_wide(w.normal_y + x)), nz(load_wide(w.normal_z + x)), instance(load(w.instance + x)) {}
};

/// Weighted sums of what the history has at the pixels around.
struct HistorySums {
  F32 weight{}, mean{}, square{}, fast{}, samples{};

  /// Weighted by similarity: 0 for another surface, up to 1 for a perfect match.
  /// @param ignored bits in which instances may differ
  template <int kSquarings>
  void add(const PreviousPixels& p, ptrdiff_t at, const WantedSurfaces& w, F32 bilinear, int32_t ignored) {
    const F32 there = load(p.disparity + at), count = load(p.samples + at);
    const F32 distance = magnitude(there - w.disparity);
    const I32 dot =
        load_wide(p.normal_x + at) * w.nx + load_wide(p.normal_y + at) * w.ny + load_wide(p.normal_z + at) * w.nz;
    F32 cosine = lesser(greater(as_floats(dot) * (1.1f * kSquaredNormalUnit), all(0.0f)), all(1.0f));
    for (int i = 0; i < kSquarings; ++i) cosine *= cosine;
    const F32 agreement = w.tolerance / greater(distance, w.tolerance) * cosine;
    const I32 differs = (load(p.instance + at) ^ w.instance) & ~ignored;
    const I32 same = (there > 0.0f) & (count > 0.0f) & (distance <= 2.0f * w.tolerance) & (differs == 0);
    const F32 part = select(same, bilinear * agreement, all(0.0f));
    weight += part;
    mean += part * load(p.mean + at);
    square += part * as_floats(load_wide(p.square + at));
    fast += part * as_floats(load_wide(p.fast + at));
    samples += part * count;
  }
};

/// Linear interpolation.
/// @param weights sum of the weights, 0 where the history is rejected
template <int kSquarings>
void interpolate_run(int width, const PreviousPixels& from, const WantedRow& wanted, bool test_instances,
                     const PastRow& out, float* weights) {
  const PreviousPixels p = from;
  const WantedRow w = wanted;
  const PastRow o = out;
  const ptrdiff_t s = p.stride;
  const int32_t ignored = test_instances ? 0 : -1;
  for (int x = 0; x < width; x += kFloats) {
    const WantedSurfaces surfaces(w, x);
    const F32 fx = load(w.at.fraction_x + x), fy = load(w.at.fraction_y + x);
    HistorySums sums;
    const auto corner = [&](ptrdiff_t at, F32 bilinear) {
      if (any(bilinear > 0.0f)) sums.add<kSquarings>(p, at, surfaces, bilinear, ignored);
    };
    corner(x, (1.0f - fx) * (1.0f - fy));
    corner(x + 1, fx * (1.0f - fy));
    corner(x + s, (1.0f - fx) * fy);
    corner(x + s + 1, fx * fy);
    const I32 found = (sums.weight > kMinHistoryWeight) & (surfaces.disparity > 0.0f);
    const F32 nothing{}, scale = select(found, 1.0f / sums.weight, nothing);
    store(weights + x, select(found, sums.weight, nothing));
    store(o.mean + x, lesser(sums.mean * scale, all(1.0f)));
    store(o.square + x, sums.square * scale * (1.0f / kMomentUnits));
    store(o.fast + x, sums.fast * scale * (1.0f / kMomentUnits));
    store(o.samples + x, select(found, lesser(sums.samples, load(w.at.longest + x)), nothing));
  }
}

/// Bicubic interpolation of the mean, where its footprint and the eight neighbours that share edges with it lie on one
/// surface: a hard test without normals.
void sharpen_run(int width, const PreviousPixels& from, const WantedRow& wanted, const PastRow& out,
                 const float* weights) {
  const PreviousPixels p = from;
  const WantedRow w = wanted;
  const PastRow o = out;
  const ptrdiff_t s = p.stride;
  for (int x = 0; x < width; x += kFloats) {
    I32 same = load(weights + x) > kMinSharpenWeight;
    if (!any(same)) continue;
    const F32 disparity = load(w.at.disparity + x), tolerance = load(w.at.tolerance + x);
    const F32 fx = load(w.at.fraction_x + x), fy = load(w.at.fraction_y + x);
    const I32 instance = load(w.instance + x);
    const auto tap = [&](ptrdiff_t at) {
      same &= (load(p.instance + at) == instance) & (load(p.samples + at) > 0.0f) &
              (magnitude(load(p.disparity + at) - disparity) <= tolerance);
      return load(p.mean + at);
    };
    const F32 m00 = tap(x), m10 = tap(x + 1), m01 = tap(x + s), m11 = tap(x + s + 1);
    const F32 along_x = (1.0f - fy) * sharpening(tap(x - 1), m00, m10, tap(x + 2), fx) +
                        fy * sharpening(tap(x + s - 1), m01, m11, tap(x + s + 2), fx);
    const F32 along_y = (1.0f - fx) * sharpening(tap(x - s), m00, m01, tap(x + 2 * s), fy) +
                        fx * sharpening(tap(x - s + 1), m10, m11, tap(x + 2 * s + 1), fy);
    const F32 linear = load(o.mean + x), nothing{};
    const F32 sharp = lesser(greater(linear + select(same, along_x + along_y, nothing), nothing), all(1.0f));
    store(o.mean + x, sharp);
    store(o.square + x, load(o.square + x) + (sharp - linear) * (sharp + linear)); // keeps the variance
  }
}

template <int kSquarings>
void resample_run(int width, const PreviousPixels& from, const WantedRow& wanted, bool test_instances,
                  const PastRow& out, float* weights) {
  interpolate_run<kSquarings>(width, from, wanted, test_instances, out, weights);
  float between = 0.0f;
  for (int x = 0; x < width; ++x) between = greater(between, wanted.at.fraction_x[x] + wanted.at.fraction_y[x]);
  if (between > 0.0f) sharpen_run(width, from, wanted, out, weights);
}

int next_lost(int x, int width, const float* weights, const float* disparity) {
  const auto lost = [&](int at) { return (weights[at] <= kLostWeight) & (disparity[at] > 0.0f); };
  while (x < width) {
    const int end = x + kFloats < width ? x + kFloats : width;
    if (any((load(weights + x) <= kLostWeight) & (load(disparity + x) > 0.0f)))
      for (; x < end; ++x)
        if (lost(x)) return x;
    x = end;
  }
  return width;
}

void unpack_row(int width, const uint16_t* moments, float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] = moment_of(moments[x]);
}

void accumulate_row(int width, const float* ao, const float* disparity, const HistoryLengths& longest,
                    const PastRow& past, const HistoryRow& history, const SampleRow& samples) {
  const PastRow p = past;
  const HistoryRow h = history;
  const HistoryLengths most = longest;
  const SampleRow o = samples;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const bool valid = (ao[x] >= 0.0f) & (ao[x] <= kLargest) & (disparity[x] > 0.0f);
    const float value = valid ? lesser(ao[x], 1.0f) : 0.0f;
    const float count = lesser(p.samples[x] + 1.0f, most.slow);
    const float share = valid ? 1.0f / count : 0.0f;
    const float fast_share = valid ? 1.0f / lesser(count, most.fast) : 0.0f;
    const float mean = p.mean[x] + (value - p.mean[x]) * share;
    const float fast = p.fast[x] + (value - p.fast[x]) * fast_share;
    h.mean[x] = mean;
    h.square[x] = in_moment_units(p.square[x] + (value * value - p.square[x]) * share);
    h.fast[x] = in_moment_units(fast);
    h.samples[x] = valid ? count : lesser(p.samples[x], most.slow);
    o.ao[x] = value;
    o.valid[x] = valid ? 1.0f : 0.0f;
    o.change[x] = valid ? fast - mean : 0.0f;
  }
}

void keep_trends_row(int width, const float* motion, const float* samples, const float* weights, uint32_t* trend) {
  for (int x = 0; x < width; ++x) {
    const bool still = (std::abs(motion[2 * x]) <= kStillMotion) & (std::abs(motion[2 * x + 1]) <= kStillMotion);
    const uint32_t kept = trend[x];
    trend[x] = still & (samples[x] > 1.0f) & (weights[x] > kLostWeight) ? kept : 0u;
  }
}

bool any_crosses(int width, const float* valid, const float* samples, float longest) {
  int crossings = 0;
  for (int x = 0; x < width; ++x) {
    const uint32_t bits = __builtin_bit_cast(uint32_t, samples[x]);
    const bool crosses = samples[x] - __builtin_bit_cast(float, bits & 0x7f800000u) < 1.0f; // crosses_power_of_two()
    crossings |= (valid[x] > 0.0f) & (samples[x] < longest) & crosses ? 1 : 0;
  }
  return crossings != 0;
}

template <int kRadius>
void sum_windows(int width, const SampleRow& samples, const WindowSums& sums) {
  const SampleRow s = samples;
  const WindowSums o = sums;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    float count = s.valid[x - 1] + s.valid[x] + s.valid[x + 1];
    float change = s.change[x - 1] + s.change[x] + s.change[x + 1];
    float sum = s.ao[x], squares = s.ao[x] * s.ao[x];
    o.narrow_count[x] = count;
    o.narrow_change[x] = change;
    for (int r = 1; r <= kRadius; ++r) {
      if (r > 1) count += s.valid[x - r] + s.valid[x + r], change += s.change[x - r] + s.change[x + r];
      sum += s.ao[x - r] + s.ao[x + r];
      squares += s.ao[x - r] * s.ao[x - r] + s.ao[x + r] * s.ao[x + r];
    }
    o.count[x] = count;
    o.sum[x] = sum;
    o.squares[x] = squares;
    o.change[x] = change;
  }
}

template <int kRadius>
void finish_windows(int width, const WindowSums* rows, const LocalRow& local) {
  std::array<WindowSums, 2 * kRadius + 1> r;
  for (size_t i = 0; i < r.size(); ++i) r[i] = rows[i];
  const LocalRow o = local;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    float count = 0.0f, sum = 0.0f, squares = 0.0f, change = 0.0f, narrow_count = 0.0f, narrow_change = 0.0f;
    for (int i = 0; i <= 2 * kRadius; ++i) {
      const WindowSums& row = r[static_cast<size_t>(i)];
      count += row.count[x], sum += row.sum[x], squares += row.squares[x], change += row.change[x];
      if (i >= kRadius - 1 && i <= kRadius + 1)
        narrow_count += row.narrow_count[x], narrow_change += row.narrow_change[x];
    }
    const float n = greater(count, 1.0f);
    const float spread = squares - sum * (sum / n);
    o.count[x] = count;
    o.variance[x] = count > 1.0f ? greater(spread, 0.0f) / greater(n - 1.0f, 1.0f) : 0.0f;
    o.change[x] = change / n;
    o.narrow_count[x] = narrow_count;
    o.narrow_change[x] = narrow_change / greater(narrow_count, 1.0f);
  }
}

/// Reduces the magnitude of `change` by `limit`, at most to 0 (soft threshold).
inline float excess(float change, float limit) {
  return std::copysign(greater(std::abs(change) - limit, 0.0f), change);
}

void correct_row(int width, const LocalRow& local, const CorrectTerms& terms, const HistoryRow& history,
                 uint32_t* trend) {
  const LocalRow l = local;
  const CorrectTerms t = terms;
  const HistoryRow h = history;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float noise = l.variance[x] * t.fast_share;
    const float wide = excess(l.change[x], t.gamma * std::sqrt(noise / greater(l.count[x], 1.0f)) + t.tolerance);
    const float narrow =
        excess(l.narrow_change[x], t.gamma * std::sqrt(noise / greater(l.narrow_count[x], 1.0f)) + t.tolerance);
    const float wanted = std::abs(narrow) > std::abs(wide) ? narrow : wide;
    const float old_mean = h.mean[x];
    const float new_mean = h.samples[x] > 0.0f ? lesser(greater(old_mean + wanted, 0.0f), 1.0f) : old_mean;
    const float shift = new_mean - old_mean;
    const float kept = 1.0f - lesser(t.response * std::abs(shift), 1.0f);
    const float n = lesser(h.samples[x], greater(h.samples[x] * kept, t.fast_frames));
    const uint16_t old_square = h.square[x];
    const float spread = greater(moment_of(old_square) - old_mean * old_mean, 0.0f); // a shift keeps the variance
    h.mean[x] = new_mean;
    h.square[x] = shift == 0.0f ? old_square : in_moment_units(spread + new_mean * new_mean);
    h.samples[x] = n;
    trend[x] = shift == 0.0f ? trend[x] : 0u;
  }
}

template <int... kPowers>
constexpr HistoryKernels history_table(std::integer_sequence<int, kPowers...>) {
  return {locate_row,
          {resample_run<kPowers>...},
          next_lost,
          unpack_row,
          accumulate_row,
          keep_trends_row,
          any_crosses,
          {nullptr, sum_windows<1>, sum_windows<2>, sum_windows<3>, sum_windows<4>},
          {nullptr, finish_windows<1>, finish_windows<2>, finish_windows<3>, finish_windows<4>},
          correct_row};
}

constexpr HistoryKernels kHistoryRows = history_table(std::make_integer_sequence<int, kMaxNormalSquarings + 1>());

} // namespace
} // namespace packtrace
