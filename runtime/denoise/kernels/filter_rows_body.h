#pragma once

// Compiled once per instruction set. Everything is local to the file that includes it, so that no function of a wider
// instruction set replaces another file's.

#include <cmath>

#include "runtime/denoise/kernels/filter_rows.h"

namespace packtrace {
namespace {

constexpr float kStraight = 0.707f / 255.0f, kDiagonal = 0.499f / 255.0f;
constexpr float kLoneBase = 0.7f, kLoneYoung = 0.3f;
constexpr float kMaxVariance = 0.25f; // of values in [0, 1]

inline float lesser(float a, float b) { return b < a ? b : a; }
inline float greater(float a, float b) { return a < b ? b : a; }
inline float of_byte(uint8_t b) { return static_cast<float>(static_cast<int>(b)); }

void guide_row(int width, const SurfaceRow& p, const SurfaceRow& q, const GuideTerms& terms,
               uint8_t* __restrict weights) {
  const SurfaceRow a = p, b = q;
  const GuideTerms t = terms;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float difference = b.disparity[x] - a.disparity[x];
    const float rise_a = a.dx[x] * t.offset_x + a.dy[x] * t.offset_y;
    const float rise_b = b.dx[x] * t.offset_x + b.dy[x] * t.offset_y;
    const float distance = greater(std::abs(difference - rise_a), std::abs(difference - rise_b));
    // The flatter of the two slopes, since one of them may be meaninglessly steep at a silhouette.
    const float allowed = t.depth * lesser(a.disparity[x], b.disparity[x]) +
                          t.slope * lesser(std::abs(rise_a), std::abs(rise_b)) + 1e-37f;
    const float depth = greater(0.0f, 1.0f - distance / allowed);
    float cosine = a.nx[x] * b.nx[x] + a.ny[x] * b.ny[x] + a.nz[x] * b.nz[x];
    cosine = lesser(greater(cosine, 0.0f), 1.0f);
    cosine *= cosine, cosine *= cosine, cosine *= cosine;
    const float weight = greater(depth * depth * cosine * 255.0f + 0.5f, float{kMinGuide});
    const bool both = (a.disparity[x] > 0.0f) & (b.disparity[x] > 0.0f);
    weights[x] = static_cast<uint8_t>(static_cast<int>(both ? weight : 0.0f));
  }
}

void compare_row(int width, const float* p, const float* p_variance, const float* q, const float* q_variance,
                 const uint8_t* guide, float tolerance, float* __restrict distance) {
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float difference = q[x] - p[x];
    const float noise = p_variance[x] + q_variance[x];
    const float d = (difference * difference - noise) / (tolerance * noise + 1e-6f);
    distance[x] = guide[x] != 0 ? d : 0.0f;
  }
}

void weigh_row(int width, const std::array<const float*, 3>& distance, const uint8_t* guide, float limit,
               float* __restrict column, uint8_t* __restrict weights) {
  const float *d0 = distance[0], *d1 = distance[1], *d2 = distance[2];
  for (int x = -1; x <= width; ++x) column[x] = d0[x] + d1[x] + d2[x];
  const float slope = -1.0f / (9.0f * limit);
  for (int x = 0; x < width; ++x) {
    const float sum = column[x - 1] + column[x] + column[x + 1];
    float keep = lesser(greater(1.0f + sum * slope, 0.0f), 1.0f);
    keep *= keep, keep *= keep;
    weights[x] = static_cast<uint8_t>(static_cast<int>(of_byte(guide[x]) * keep + 0.5f));
  }
}

void normalise_row(int width, int step, const PairRow& here, const PairRow& above, const float* samples,
                   float* __restrict scale) {
  const uint8_t *right = here[0], *down = here[1], *down_right = here[2], *down_left = here[3];
  const uint8_t *up = above[1], *up_left = above[2], *up_right = above[3];
  const auto straight = [&](int x) {
    return static_cast<int>(right[x]) + static_cast<int>(right[x - step]) + static_cast<int>(down[x]) +
           static_cast<int>(up[x]);
  };
  const auto diagonal = [&](int x) {
    return static_cast<int>(down_right[x]) + static_cast<int>(up_left[x - step]) + static_cast<int>(down_left[x]) +
           static_cast<int>(up_right[x + step]);
  };
  if (samples == nullptr) {
#pragma GCC ivdep
    for (int x = 0; x < width; ++x)
      scale[x] =
          1.0f / (1.0f + (kStraight * static_cast<float>(straight(x)) + kDiagonal * static_cast<float>(diagonal(x))));
    return;
  }
  const auto larger_byte = [](uint8_t a, uint8_t b) { return a < b ? b : a; };
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const uint8_t most = larger_byte(
        larger_byte(larger_byte(right[x], right[x - step]), larger_byte(down[x], up[x])),
        larger_byte(larger_byte(down_right[x], up_left[x - step]), larger_byte(down_left[x], up_right[x + step])));
    const float lone = kLoneBase + kLoneYoung / greater(samples[x], 1.0f);
    const float own = 1.0f - lone * (1.0f - of_byte(most) * (1.0f / 255.0f));
    const float sum = kStraight * static_cast<float>(straight(x)) + kDiagonal * static_cast<float>(diagonal(x));
    scale[x] = 1.0f / greater(own + sum, 1e-3f);
  }
}

void exchange_row(int width, int step, const PassRows& rows, float* __restrict value, float* __restrict variance) {
  const PassRows r = rows;
  const uint8_t *right = r.here[0], *down = r.here[1], *down_right = r.here[2], *down_left = r.here[3];
  const uint8_t *up = r.above[1], *up_left = r.above[2], *up_right = r.above[3];
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float a = r.value[x], s = r.scale[x];
    float flux = 0.0f, taken = 0.0f, noise = 0.0f;
    const auto pair = [&](uint8_t weight, float gain, const float* q, const float* q_variance, const float* q_scale,
                          int at) {
      const float u = of_byte(weight) * gain * lesser(s, q_scale[at]);
      flux += u * (q[at] - a);
      taken += u;
      noise += u * u * q_variance[at];
    };
    pair(right[x], kStraight, r.value, r.variance, r.scale, x + step);
    pair(right[x - step], kStraight, r.value, r.variance, r.scale, x - step);
    pair(down[x], kStraight, r.value_below, r.variance_below, r.scale_below, x);
    pair(up[x], kStraight, r.value_above, r.variance_above, r.scale_above, x);
    pair(down_right[x], kDiagonal, r.value_below, r.variance_below, r.scale_below, x + step);
    pair(up_left[x - step], kDiagonal, r.value_above, r.variance_above, r.scale_above, x - step);
    pair(down_left[x], kDiagonal, r.value_below, r.variance_below, r.scale_below, x - step);
    pair(up_right[x + step], kDiagonal, r.value_above, r.variance_above, r.scale_above, x + step);
    const float kept = 1.0f - taken;
    value[x] = a + flux;
    variance[x] = lesser(kept * kept * r.variance[x] + noise, r.variance[x]);
  }
}

void moments_row(int width, const float* mean, const float* square, const float* samples, const MomentRows& out) {
  const MomentRows o = out;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float a = mean[x], n = samples[x];
    const float seen = n > 0.0f ? 1.0f : 0.0f, spread_seen = n >= 2.0f ? 1.0f : 0.0f;
    const float spread = greater(square[x] - a * a, 0.0f) * n / greater(n - 1.0f, 1.0f);
    o.seen[x] = seen;
    o.value[x] = a * seen;
    o.square[x] = a * a * seen;
    o.spread_seen[x] = spread_seen;
    o.spread[x] = spread * spread_seen;
  }
}

void sum_along_row(int width, int radius, const float* in, float* __restrict out) {
  if (radius == 2) {
    for (int x = 0; x < width; ++x) out[x] = ((in[x - 2] + in[x - 1]) + (in[x] + in[x + 1])) + in[x + 2];
    return;
  }
  for (int x = 0; x < width; ++x) out[x] = (in[x - 1] + in[x]) + in[x + 1];
  for (int r = 2; r <= radius; ++r)
    for (int x = 0; x < width; ++x) out[x] += in[x - r] + in[x + r];
}

void add_row(int width, const float* in, float* __restrict sum) {
  for (int x = 0; x < width; ++x) sum[x] += in[x];
}

/// log2 and exp2 of positive normal numbers, without library calls, so that all instruction sets give the same bits.
inline float log2_of(float x) {
  const int32_t bits = __builtin_bit_cast(int32_t, x);
  const float exponent = static_cast<float>((bits >> 23) - 127);
  const float m = __builtin_bit_cast(float, (bits & 0x7fffff) | 0x3f800000) - 1.0f;
  // Error below 2e-4 on [0, 1].
  return exponent + m * (1.4418256f + m * (-0.7057096f + m * (0.41450846f + m * (-0.19365396f + m * 0.04303296f))));
}
inline float exp2_of(float x) { // of x in [-100, 0]
  const float whole = static_cast<float>(static_cast<int>(x) - 1);
  const float f = x - whole; // in (0, 1]
  const float m = 1.0f + f * (0.6951786f + f * (0.2276186f + f * 0.0772028f));
  return m * __builtin_bit_cast(float, (static_cast<int32_t>(whole) + 127) << 23);
}

void variance_row(int width, const float* mean, const float* square, const float* samples, const MomentRows& window,
                  const VarianceTerms& terms, float* __restrict estimate, float* __restrict variance) {
  const MomentRows w = window;
  const VarianceTerms t = terms;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float a = mean[x], n = greater(samples[x], 1.0f);
    const float count = greater(w.seen[x], 1.0f);
    const float space = greater(w.square[x] - w.value[x] * w.value[x] / count, 0.0f) / greater(count - 1.0f, 1.0f);
    const float around = w.spread_seen[x] > 0.0f ? w.spread[x] / greater(w.spread_seen[x], 1.0f) : space;
    const float own = greater(square[x] - a * a, 0.0f) * n; // (n - 1) s2
    float spread = (t.prior * around + own) / (t.prior + n - 1.0f);
    spread = n < 2.0f ? space : spread;
    spread = (t.moving & (n < 4.0f)) ? greater(spread, 0.5f * space) : spread;
    const float still = t.still_factor * exp2_of(-t.still_power * log2_of(n));
    const float moving = t.moving_base + t.moving_gain * n;
    const float ratio = lesser((t.moving & (n <= t.longest_moving)) ? moving : still, 1.0f);
    const float v = spread * (n < 2.0f ? 1.0f : ratio) / n;
    const bool seen = samples[x] > 0.0f;
    estimate[x] = seen ? v : 0.0f;
    variance[x] = seen ? v * (1.0f + t.young / n + t.distrust / (n * n)) : kMaxVariance * (1.0f + t.distrust);
  }
}

constexpr FilterKernels kKernels = {guide_row,   compare_row,   weigh_row, normalise_row, exchange_row,
                                    moments_row, sum_along_row, add_row,   variance_row};

} // namespace
} // namespace packtrace
