#pragma once

// Compiled once per instruction set. Everything is local to the file that includes it, so that no function of a wider
// instruction set replaces another file's.

#include <cmath>

#include "runtime/denoise/kernels/filter_rows.h"
#include "runtime/denoise/kernels/lanes.h"
#include "runtime/denoise/kernels/row_math.h"

namespace packtrace {
namespace {

/// 1 / sqrt(x) with a relative error below 0.2 %: minus half the exponent and a step of Newton's method.
inline float reciprocal_root(float x) {
  const float r = __builtin_bit_cast(float, 0x5f375a86 - (__builtin_bit_cast(int32_t, x) >> 1));
  return r * (1.5f - 0.5f * x * r * r);
}

inline F32 reciprocal_root(F32 x) {
  const F32 r = (F32)(0x5f375a86 - ((I32)x >> 1));
  return r * (1.5f - 0.5f * x * r * r);
}

/// The surfaces at some pixels.
struct Surfaces {
  F32 disparity;
  I32 normal_xy, normal_z;
};

inline Surfaces load(const SurfaceRow& row, int at) {
  return {load(row.disparity + at), load(row.normal_xy + at), load(row.normal_z + at)};
}

/// Guide weights of pairs of pixels in one direction.
/// @param scale 1 / distance of a pair in pixels: a power of two, so that scaling all lengths by it changes no rounding
inline I32 guide_weights(const Surfaces& p, F32 rise_p, const Surfaces& q, F32 rise_q, float scale,
                         const GuideTerms& t) {
  const F32 difference = (q.disparity - p.disparity) * scale;
  const F32 distance = greater(magnitude(difference - rise_p), magnitude(difference - rise_q));
  const F32 nearer = lesser(p.disparity, q.disparity), least = nearer * (t.depth * scale);
  // One of the slopes may be arbitrarily steep at a silhouette: uses the smaller one, and clamps the curvature term.
  const F32 allowed = least + lesser(magnitude(rise_p), magnitude(rise_q)) * t.slope +
                      lesser(magnitude(rise_p - rise_q) * t.bend, least * kMaxBend) + 1e-37f * scale;
  const F32 depth = greater(all(0.0f), 1.0f - distance / allowed);
  const I32 dot = sum_of_products(p.normal_xy, q.normal_xy) + sum_of_products(p.normal_z, q.normal_z);
  F32 cosine = lesser(greater(as_floats(dot) * kSquaredNormalUnit, all(0.0f)), all(1.0f));
  cosine *= cosine, cosine *= cosine, cosine *= cosine;
  const F32 weight = greater(depth * depth * cosine * 255.0f + 0.5f, all(float{kMinGuide}));
  return truncated(nearer > 0.0f ? weight : all(0.0f));
}

void guide_row(int width, int step, const SurfaceRow& here, const SurfaceRow& below, const GuideTerms& terms,
               const std::array<uint8_t*, 4>& weights) {
  const SurfaceRow p = here, q = below;
  const GuideTerms t = terms;
  const float scale = 1.0f / static_cast<float>(step);
  uint8_t *right = weights[0], *down = weights[1], *down_right = weights[2], *down_left = weights[3];
  for (int x = 0; x < width; x += kFloats) {
    const Surfaces own = load(p, x);
    const auto pair = [&](size_t direction, const SurfaceRow& other, int at) {
      return guide_weights(own, load(p.rise[direction] + x), load(other, at), load(other.rise[direction] + at), scale,
                           t);
    };
    store_bytes(right + x, pair(0, p, x + step));
    store_bytes(down + x, pair(1, q, x));
    store_bytes(down_right + x, pair(2, q, x + step));
    store_bytes(down_left + x, pair(3, q, x - step));
  }
}

void lone_guide_row(int width, const PairRow& here, const PairRow& above, const float* disparity,
                    uint8_t* __restrict lone) {
  const PairRow h = here, a = above;
  for (int x = 0; x < width; ++x) {
    const int company =
        h[0][x] + h[0][x - 1] + h[1][x] + a[1][x] + h[2][x] + a[2][x - 1] + h[3][x] + a[3][x + 1]; // all eight pairs
    const int missing = company < kCompany ? kCompany - company : 0;
    constexpr int kGain = 65536 * kLoneGuide / kCompany + 1; // rounded up, so that kLoneGuide is reached
    lone[x] = static_cast<uint8_t>(disparity[x] > 0.0f ? (missing * kGain) >> 16 : 0);
  }
}

inline uint8_t raised(uint8_t weight, uint8_t p, uint8_t q) {
  const uint8_t least = p < q ? p : q;
  return weight < least ? least : weight;
}

void raise_guides_row(int width, int step, const PairRow& weights, const uint8_t* here, const uint8_t* below,
                      const std::array<uint8_t*, 4>& raised_weights) {
  const PairRow w = weights;
  uint8_t *right = raised_weights[0], *down = raised_weights[1], *down_right = raised_weights[2],
          *down_left = raised_weights[3];
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    right[x] = raised(w[0][x], here[x], here[x + step]);
    down[x] = raised(w[1][x], here[x], below[x]);
    down_right[x] = raised(w[2][x], here[x], below[x + step]);
    down_left[x] = raised(w[3][x], here[x], below[x - step]);
  }
}

/// 1 / sqrt(v_p + v_q) from 1 / sqrt(2 v) of both: an approximation to within 5 % without a division.
inline U16 precision_of_pair(U16 p, U16 q) {
  const U16 least = lesser(p, q), most = greater(p, q);
  return lesser(average(least, average(least, most)), least + (least >> 2) + (least >> 3));
}

void compare_row(int width, int step, const NoisyRow& here, const NoisyRow& below, uint16_t no_distance,
                 const std::array<uint16_t*, 4>& distance) {
  const NoisyRow p = here, q = below;
  uint16_t *right = distance[0], *down = distance[1], *down_right = distance[2], *down_left = distance[3];
  const U16 nothing = all(no_distance), most = all(kMaxDeviations);
  for (int x = 0; x < width; x += kLanes) {
    const I16 value = load(p.value + x);
    const U16 own_precision = load(p.precision + x);
    const auto pair = [&](const NoisyRow& other, int at) {
      const U16 difference = magnitude(load(other.value + at) - value);
      const U16 precision = precision_of_pair(own_precision, load(other.precision + at));
      const U16 deviations = lesser(product(difference << 1, precision), most);
      const U16 squared = (deviations * (deviations + 1)) >> 3; // n (n + 1) is about the mean square from n to n + 1
      return precision == 0 ? nothing : squared;
    };
    store(right + x, pair(p, x + step));
    store(down + x, pair(q, x));
    store(down_right + x, pair(q, x + step));
    store(down_left + x, pair(q, x - step));
  }
}

void weigh_row(int width, const std::array<DistanceRows, 4>& distance, const PairRow& guide, ptrdiff_t guide_stride,
               const PatchTerms& terms, const std::array<uint16_t*, 4>& columns,
               const std::array<uint16_t*, 4>& weights) {
  // Loads that overlap two recent stores wait for them, so all columns are stored before they are read.
  for (size_t d = 0; d < distance.size(); ++d)
    for (int x = -kLanes; x <= width; x += kLanes)
      store(columns[d] + x, load(distance[d][0] + x) + load(distance[d][1] + x) + load(distance[d][2] + x));
  const U16 nothing = all(static_cast<uint16_t>(9 * terms.no_distance)), limit = all(terms.limit);
  const U16 most = limit >> terms.shift, stretch = all(terms.stretch);
  for (size_t d = 0; d < distance.size(); ++d) {
    const uint16_t gain = d < 2 ? kStraight : kDiagonal; // kPairOffsets
    for (int x = 0; x < width; x += kLanes) {
      __builtin_prefetch(guide[d] + x + guide_stride);
      const U16 sum = load(columns[d] + x - 1) + load(columns[d] + x) + load(columns[d] + x + 1);
      const U16 excess = lesser(greater(sum, nothing) - nothing, most);
      const U16 left = limit - (excess << terms.shift);
      const U16 kept = left + product(left, stretch), square = product(kept, kept);
      store(weights[d] + x, product(product(square, square), load_bytes(guide[d] + x) * gain));
    }
  }
}

/// Weights of the eight pairs of some pixels. Those across an edge of the image are 0.
struct Neighbours {
  U16 right, left, down, up, down_right, up_left, down_left, up_right;

  Neighbours(const WeightRow& here, const WeightRow& above, int x, int step)
      : right(load(here[0] + x)), left(load(here[0] + x - step)), down(load(here[1] + x)), up(load(above[1] + x)),
        down_right(load(here[2] + x)), up_left(load(above[2] + x - step)), down_left(load(here[3] + x)),
        up_right(load(above[3] + x + step)) {}

  /// The mean in units of 2^-16, which is the sum in units of 2^-13.
  U16 mean() const {
    return average(average(average(right, left), average(down, up)),
                   average(average(down_right, up_left), average(down_left, up_right)));
  }
  /// The largest of the weights in units of their gains, to within 0.4 %.
  U16 largest() const {
    constexpr uint16_t kStretch = 65536 * (65535 - 255 * kStraight) / (255 * kStraight);
    const U16 straight = greater(greater(right, left), greater(down, up));
    const U16 diagonal = greater(greater(down_right, up_left), greater(down_left, up_right));
    return greater(straight + product(straight, all(kStretch)), diagonal << 1);
  }
};

/// Kernels of 16-bit values write this many. Pixels outside the image have a precision of 0, so their weights are 0.
inline int whole_vectors(int width) { return (width + kLanes - 1) / kLanes * kLanes; }

/// Replaces each value x by numerator / x.
void invert_row(int width, float numerator, uint16_t* row) {
  for (int x = 0; x < whole_vectors(width); ++x)
    row[x] = static_cast<uint16_t>(static_cast<int>(numerator / static_cast<float>(static_cast<int>(row[x]))));
}

void normalise_row(int width, int step, const WeightRow& here, const WeightRow& above, uint16_t* scale) {
  for (int x = 0; x < width; x += kLanes) store(scale + x, Neighbours(here, above, x, step).mean() + 8192);
  invert_row(width, 8192.0f * 32768.0f, scale);
}

void normalise_first_row(int width, int step, const WeightRow& here, const WeightRow& above, const uint16_t* lone,
                         uint16_t* scale) {
  constexpr uint16_t kMinScale = 1025; // so that the result has 16 bits
  for (int x = 0; x < width; x += kLanes) {
    const Neighbours weights(here, above, x, step);
    const U16 own = 8192 - product(65535 - weights.largest(), load(lone + x));
    store(scale + x, greater(own + weights.mean(), all(kMinScale)));
  }
  invert_row(width, 8192.0f * 8192.0f, scale);
}

/// @param variance relative remaining variance, in units of 2^-14
void raise_precisions(int width, const uint16_t* variance, const uint16_t* before, uint16_t* precision) {
#pragma GCC ivdep
  for (int x = 0; x < whole_vectors(width); ++x) {
    const float left = static_cast<float>(static_cast<int>(variance[x])) * (1.0f / 16384.0f);
    const float p = static_cast<float>(static_cast<int>(before[x])) * greater(reciprocal_root(left), 1.0f);
    precision[x] = static_cast<uint16_t>(static_cast<int>(lesser(p + 0.5f, kMaxPrecision)));
  }
}

/// @tparam kFirst the scale is in units of 2^-13, not 2^-15
/// @tparam kLast whether this is the last pass, whose precisions are never read
template <bool kFirst, bool kLast>
void exchange_row(int width, int step, const PassRows& rows, int16_t* value, uint16_t* precision) {
  const PassRows r = rows;
  for (int x = 0; x < width; x += kLanes) {
    const Neighbours weights(r.here, r.above, x, step);
    const I16 own = load(r.value + x);
    const U16 scale = load(r.scale + x);
    I16 flux{};
    U16 taken{}, squares{}; // in units of 2^-15 and 2^-14
    const auto pair = [&](U16 weight, const int16_t* q, const uint16_t* q_scale) {
      U16 u = product(weight, lesser(scale, load(q_scale)));
      if (kFirst) u <<= 2;
      flux += part_of(u, load(q) - own);
      if (!kLast) taken += u, squares += product(u, u);
    };
    pair(weights.right, r.value + x + step, r.scale + x + step);
    pair(weights.left, r.value + x - step, r.scale + x - step);
    pair(weights.down, r.value_below + x, r.scale_below + x);
    pair(weights.up, r.value_above + x, r.scale_above + x);
    pair(weights.down_right, r.value_below + x + step, r.scale_below + x + step);
    pair(weights.up_left, r.value_above + x - step, r.scale_above + x - step);
    pair(weights.down_left, r.value_below + x - step, r.scale_below + x - step);
    pair(weights.up_right, r.value_above + x + step, r.scale_above + x + step);
    store(value + x, own + flux);
    const U16 kept = 32768 - taken;
    if (!kLast) store(precision + x, product(kept, kept) + squares);
  }
  if (!kLast) raise_precisions(width, precision, r.precision, precision);
}

/// MomentRows::counts; windows have fewer than 32 pixels.
constexpr float kSecondCount = 32.0f, kThirdCount = 1024.0f;

void moments_row(int width, const float* mean, const uint16_t* square, const float* samples, const uint32_t* trend,
                 const MomentRows& out) {
  const MomentRows o = out;
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) {
    const float a = mean[x], n = samples[x];
    const float seen = n > 0.0f ? 1.0f : 0.0f, spread_seen = n >= 2.0f ? 1.0f : 0.0f;
    const float spread = greater(moment_of(square[x]) - a * a, 0.0f) * n / greater(n - 1.0f, 1.0f);
    const float decay = __builtin_bit_cast(float, trend[x] & 0xffff0000u); // Trend::decay
    const float decay_seen = (n > 0.0f) & (decay > 0.0f) ? 1.0f : 0.0f;
    o.counts[x] = seen + kSecondCount * spread_seen + kThirdCount * decay_seen;
    o.value[x] = a * seen;
    o.square[x] = a * a * seen;
    o.spread[x] = spread * spread_seen;
    o.decay[x] = decay * decay_seen;
  }
}

void sum_along_row(int width, const float* in, float* __restrict out) {
  static_assert(kMomentWindow == 5);
  for (int x = 0; x < width; ++x) out[x] = ((in[x - 2] + in[x - 1]) + (in[x] + in[x + 1])) + in[x + 2];
}

/// log2 and exp2 of positive normal numbers, without library calls, so that all instruction sets give the same bits.
inline F32 log2_of(F32 x) {
  const F32 exponent = as_floats(((I32)x >> 23) - 127);
  const F32 m = (F32)(((I32)x & 0x7fffff) | 0x3f800000) - 1.0f;
  // Error below 2e-4 on [0, 1].
  return exponent + m * (1.4418256f + m * (-0.7057096f + m * (0.41450846f + m * (-0.19365396f + m * 0.04303296f))));
}
inline F32 exp2_of(F32 x) { // of x in [-100, 0]
  const I32 whole = truncated(x) - 1;
  const F32 f = x - as_floats(whole); // in (0, 1]
  const F32 m = 1.0f + f * (0.6951786f + f * (0.2276186f + f * 0.0772028f));
  return m * (F32)((whole + 127) << 23);
}

/// The window around some pixels.
class WindowOfPixels {
public:
  WindowOfPixels(const MomentWindow& rows, int x) : rows_(rows), x_(x), counts_(truncated(sum(&MomentRows::counts))) {}

  F32 sum(float* MomentRows::* moments) const {
    F32 total{};
    for (const MomentRows& row : rows_) total += load(row.*moments + x_);
    return total;
  }
  F32 count() const { return greater(as_floats(counts_ & 31), all(1.0f)); }
  F32 with_spread() const { return as_floats((counts_ >> 5) & 31); }
  F32 with_decay() const { return as_floats(counts_ >> 10); }

private:
  const MomentWindow& rows_;
  int x_;
  I32 counts_;
};

/// Variances of a sample at some pixels.
/// @param own mean square minus squared mean
inline F32 spread_of(const WindowOfPixels& window, F32 n, F32 own, const VarianceTerms& t) {
  const F32 with_spread = window.with_spread(), divisor = greater(with_spread, all(1.0f));
  const F32 spreads = window.sum(&MomentRows::spread);
  // Blends the neighbourhood's variance, with weight `prior`, and the pixel's own variance.
  const auto mixed = [&](F32 around) {
    return (t.prior * around + own * n * divisor) / ((t.prior + n - 1.0f) * divisor);
  };
  const float young = t.moving ? 4.0f : 2.0f;
  const bool means = t.per_sample < 1.0f;
  if (!means && !any((n < young) | (with_spread <= 0.0f))) return mixed(spreads);
  const F32 count = window.count(), value = window.sum(&MomentRows::value);
  const F32 squares = window.sum(&MomentRows::square);
  const F32 space = greater(squares * count - value * value, all(0.0f)) / (count * greater(count - 1.0f, all(1.0f)));
  F32 spread = select(n < 2.0f, space, mixed(select(with_spread > 0.0f, spreads, space)));
  if (t.moving) spread = select(n < young, greater(spread, 0.5f * space), spread);
  if (!means) return spread;
  const F32 mean = value / count;
  return lesser(spread, mean * (1.0f - mean) * t.most_spread);
}

/// Variances of the means of n stratified samples, times n / spread, where the law of still pixels holds.
inline F32 still_ratio(const WindowOfPixels& window, F32 n, F32 spread, const VarianceTerms& t) {
  F32 factor = all(t.still_factor);
  const F32 with_decay = window.with_decay();
  if (t.stratified && any(with_decay > 0.0f)) {
    const F32 measured = t.ratio_prior * t.still_factor * spread + window.sum(&MomentRows::decay);
    factor = select((with_decay > 0.0f) & (spread > 0.0f), measured / ((t.ratio_prior + with_decay) * spread), factor);
  }
  return factor * exp2_of(-t.still_power * log2_of(n));
}

void variance_row(int width, const HistoryOfRow& history, const MomentWindow& window, const VarianceTerms& terms,
                  float* estimate, const FirstRow& first) {
  const HistoryOfRow h = history;
  const VarianceTerms t = terms;
  const FirstRow o = first;
  const float longest_moving = t.moving ? t.longest_moving : 0.0f;
  for (int x = 0; x < width; x += kFloats) {
    const WindowOfPixels around(window, x);
    const F32 a = load(h.mean + x), samples = load(h.samples + x), n = greater(samples, all(1.0f));
    const F32 own = greater(moments_of(load_wide(h.square + x)) - a * a, all(0.0f));
    const F32 spread = spread_of(around, n, own, t);
    F32 ratio = t.moving_base + t.moving_gain * n;
    if (any(n > longest_moving)) ratio = select(n <= longest_moving, ratio, still_ratio(around, n, spread, t));
    ratio = select(n < 2.0f, all(1.0f), lesser(ratio, all(1.0f)));
    const F32 share = 1.0f / n, v = spread * ratio * share, sample_share = share * t.per_sample;
    const I32 seen = samples > 0.0f;
    store(estimate + x, select(seen, v, all(0.0f)));
    const F32 told = select(seen, v * (1.0f + sample_share * (t.young + t.distrust * sample_share)),
                            all(kMaxVariance * (1.0f + t.distrust)));
    const F32 root = reciprocal_root(2.0f * t.tolerance * told + 1e-6f);
    const F32 precision = lesser(greater(kPrecisionUnits * root + 0.5f, all(1.0f)), all(kMaxPrecision));
    const F32 bounded = lesser(greater(all(0.0f), a), all(1.0f)); // in_ao_units()
    store_words(o.value + x, truncated(bounded * float{kAoUnits} + 0.5f));
    store_words(o.precision + x, truncated(select(load(h.disparity + x) > 0.0f, precision, all(0.0f))));
    store_words(o.lone + x, truncated(8192.0f * (kLoneBase + kLoneYoung * sample_share)));
  }
}

bool any_to_fill(int width, const float* disparity, const float* samples) {
  int found = 0;
  for (int x = 0; x < width; ++x) found |= ((disparity[x] > 0.0f) & !(samples[x] > 0.0f)) ? 1 : 0;
  return found != 0;
}

void finish_row(int width, const int16_t* value, const float* mean, const float* disparity, const float* samples,
                float* __restrict ao, float* __restrict tspp) {
  constexpr float kMiss = -1.0f; // kInvalidAo
  for (int x = 0; x < width; ++x) {
    const float before = samples[x] > 0.0f ? mean[x] : ao[x];
    const float moved = static_cast<float>(value[x] - in_ao_units(before)) * (1.0f / float{kAoUnits});
    ao[x] = disparity[x] > 0.0f ? lesser(greater(before + moved, 0.0f), 1.0f) : kMiss;
    tspp[x] = samples[x];
  }
}

constexpr FilterKernels kKernels = {guide_row,
                                    lone_guide_row,
                                    raise_guides_row,
                                    compare_row,
                                    weigh_row,
                                    normalise_row,
                                    normalise_first_row,
                                    exchange_row<false, false>,
                                    exchange_row<true, false>,
                                    exchange_row<false, true>,
                                    exchange_row<true, true>,
                                    moments_row,
                                    sum_along_row,
                                    variance_row,
                                    any_to_fill,
                                    finish_row};

} // namespace
} // namespace packtrace
