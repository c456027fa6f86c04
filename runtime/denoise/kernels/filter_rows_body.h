#pragma once

// Compiled once per instruction set. Everything is local to the file that includes it, so that no function of a wider
// instruction set replaces another file's.

#include <cmath>

#include "runtime/denoise/kernels/filter_rows.h"
#include "runtime/denoise/kernels/row_math.h"

namespace packtrace {
namespace {

constexpr float kStraight = 0.707f / 255.0f, kDiagonal = 0.499f / 255.0f;
constexpr float kLoneBase = 0.7f, kLoneYoung = 0.3f;
constexpr float kMaxVariance = 0.25f; // of values in [0, 1]

/// 1 / x for x in [1e-37, 1e37], with a relative error below 1e-5, without a division: the exponent's negative with two
/// steps of Newton's method. All instruction sets give the same bits.
inline float reciprocal(float x) {
  float r = __builtin_bit_cast(float, 0x7ef311c7 - __builtin_bit_cast(int32_t, x));
  r *= 2.0f - x * r;
  r *= 2.0f - x * r;
  return r;
}
inline float of_byte(uint8_t b) { return static_cast<float>(static_cast<int>(b)); }

/// Guide weight of the surfaces at two pixels of rows, q being at an offset from p.
inline uint8_t guide_weight(const SurfaceRow& p, int at_p, const SurfaceRow& q, int at_q, float offset_x,
                            float offset_y, const GuideTerms& t) {
  const float difference = q.disparity[at_q] - p.disparity[at_p];
  const float rise_p = p.dx[at_p] * offset_x + p.dy[at_p] * offset_y;
  const float rise_q = q.dx[at_q] * offset_x + q.dy[at_q] * offset_y;
  const float distance = greater(std::abs(difference - rise_p), std::abs(difference - rise_q));
  // The flatter of the two slopes, since one of them may be meaninglessly steep at a silhouette.
  const float allowed = t.depth * lesser(p.disparity[at_p], q.disparity[at_q]) +
                        t.slope * lesser(std::abs(rise_p), std::abs(rise_q)) + 1e-37f;
  const float depth = greater(0.0f, 1.0f - distance / allowed);
  const int dot = p.nx[at_p] * q.nx[at_q] + p.ny[at_p] * q.ny[at_q] + p.nz[at_p] * q.nz[at_q];
  float cosine = lesser(greater(static_cast<float>(dot) * kSquaredNormalUnit, 0.0f), 1.0f);
  cosine *= cosine, cosine *= cosine, cosine *= cosine;
  const float weight = greater(depth * depth * cosine * 255.0f + 0.5f, float{kMinGuide});
  const bool both = (p.disparity[at_p] > 0.0f) & (q.disparity[at_q] > 0.0f);
  return static_cast<uint8_t>(static_cast<int>(both ? weight : 0.0f));
}

void guide_row(int width, int step, const SurfaceRow& here, const SurfaceRow& below, const GuideTerms& terms,
               const std::array<uint8_t*, 4>& weights) {
  const SurfaceRow p = here, q = below;
  const GuideTerms t = terms;
  const float apart = static_cast<float>(step);
  uint8_t *right = weights[0], *down = weights[1], *down_right = weights[2], *down_left = weights[3];
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    right[x] = guide_weight(p, x, p, x + step, apart, 0.0f, t);
    down[x] = guide_weight(p, x, q, x, 0.0f, apart, t);
    down_right[x] = guide_weight(p, x, q, x + step, apart, apart, t);
    down_left[x] = guide_weight(p, x, q, x - step, -apart, apart, t);
  }
}

void compare_row(int width, int step, const NoisyRow& here, const NoisyRow& below, const PairRow& guide,
                 float tolerance, const std::array<float*, 4>& distance) {
  const NoisyRow p = here, q = below;
  const PairRow g = guide;
  float *right = distance[0], *down = distance[1], *down_right = distance[2], *down_left = distance[3];
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const auto pair = [&](const NoisyRow& other, int at, uint8_t weight) {
      const float difference = other.value[at] - p.value[x];
      const float noise = p.variance[x] + other.variance[at];
      const float d = (difference * difference - noise) * reciprocal(tolerance * noise + 1e-6f);
      return d * lesser(of_byte(weight), 1.0f); // 0 without a weight
    };
    right[x] = pair(p, x + step, g[0][x]);
    down[x] = pair(q, x, g[1][x]);
    down_right[x] = pair(q, x + step, g[2][x]);
    down_left[x] = pair(q, x - step, g[3][x]);
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

void moments_row(int width, const float* mean, const float* square, const float* samples, const uint32_t* trend,
                 const MomentRows& out) {
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
    const float decay = __builtin_bit_cast(float, trend[x] & 0xffff0000u); // Trend::decay
    o.decay_seen[x] = (n > 0.0f) & (decay > 0.0f) ? 1.0f : 0.0f;
    o.decay[x] = n > 0.0f ? decay : 0.0f;
  }
}

void sum_along_row(int width, const float* in, float* __restrict out) {
  static_assert(kMomentWindow == 5);
  for (int x = 0; x < width; ++x) out[x] = ((in[x - 2] + in[x - 1]) + (in[x] + in[x + 1])) + in[x + 2];
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

void variance_row(int width, const float* mean, const float* square, const float* samples, const MomentWindow& window,
                  const VarianceTerms& terms, float* __restrict estimate, float* __restrict variance) {
  const MomentWindow rows = window;
  const VarianceTerms t = terms;
  const float young_moving = t.moving ? 4.0f : 0.0f, longest_moving = t.moving ? t.longest_moving : 0.0f;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float a = mean[x], n = greater(samples[x], 1.0f);
    float seen_around = 0.0f, value = 0.0f, squares = 0.0f, spread_seen = 0.0f, spread_around = 0.0f;
    float decay_seen = 0.0f, decay = 0.0f;
    for (const MomentRows& r : rows) {
      seen_around += r.seen[x], value += r.value[x], squares += r.square[x];
      spread_seen += r.spread_seen[x], spread_around += r.spread[x];
      decay_seen += r.decay_seen[x], decay += r.decay[x];
    }
    const float count = greater(seen_around, 1.0f);
    const float space = greater(squares - value * value / count, 0.0f) / greater(count - 1.0f, 1.0f);
    const float around = spread_seen > 0.0f ? spread_around / greater(spread_seen, 1.0f) : space;
    const float own = greater(square[x] - a * a, 0.0f) * n; // (n - 1) s2
    float spread = (t.prior * around + own) / (t.prior + n - 1.0f);
    spread = n < 2.0f ? space : spread;
    spread = n < young_moving ? greater(spread, 0.5f * space) : spread;
    const float measured = (t.ratio_prior * t.still_factor * spread + decay) / (t.ratio_prior + decay_seen);
    const float factor = t.stratified & (spread > 0.0f) ? measured / spread : t.still_factor;
    const float still = factor * exp2_of(-t.still_power * log2_of(n));
    const float moving = t.moving_base + t.moving_gain * n;
    const float ratio = lesser(n <= longest_moving ? moving : still, 1.0f);
    const float v = spread * (n < 2.0f ? 1.0f : ratio) / n;
    const bool seen = samples[x] > 0.0f;
    estimate[x] = seen ? v : 0.0f;
    variance[x] = seen ? v * (1.0f + t.young / n + t.distrust / (n * n)) : kMaxVariance * (1.0f + t.distrust);
  }
}

bool any_to_fill(int width, const float* disparity, const float* samples) {
  int found = 0;
  for (int x = 0; x < width; ++x) found |= ((disparity[x] > 0.0f) & !(samples[x] > 0.0f)) ? 1 : 0;
  return found != 0;
}

void finish_row(int width, const float* value, const float* disparity, const float* samples, float* __restrict ao,
                float* __restrict tspp) {
  constexpr float kMiss = -1.0f; // kInvalidAo
  for (int x = 0; x < width; ++x) {
    ao[x] = disparity[x] > 0.0f ? lesser(greater(value[x], 0.0f), 1.0f) : kMiss;
    tspp[x] = samples[x];
  }
}

constexpr FilterKernels kKernels = {guide_row,   compare_row,   weigh_row,    normalise_row, exchange_row,
                                    moments_row, sum_along_row, variance_row, any_to_fill,   finish_row};

} // namespace
} // namespace packtrace
