#version 460
#extension GL_GOOGLE_include_directive : require
// What the filter starts from: means of the history with the variance of these, and values of pixels without history.
// moments_row(), sum_along_row() and variance_row() of runtime/denoise/kernels/filter_rows_body.h, and fill.cpp.
#include "denoise.glsl"

layout(local_size_x = 32, local_size_y = 8) in;
layout(std430, binding = 0) readonly restrict buffer History { vec2 history[]; };
layout(std430, binding = 1) readonly restrict buffer Rest { uvec2 rest[]; }; // moments, trend
layout(std430, binding = 2) readonly restrict buffer Guides { uvec4 guides[]; };
layout(std430, binding = 3) readonly restrict buffer PairGuides { uint pair_guides[]; };
layout(std430, binding = 4) readonly restrict buffer Changes { uint changes[]; };
layout(std430, binding = 5) writeonly restrict buffer Noisy { uint noisy[]; };
layout(std430, binding = 6) restrict buffer Result { float result[]; }; // planes of AO, variance and length

const int kGroupWidth = 32, kGroupHeight = 8, kBorder = 2;
const int kStride = kGroupWidth + 2 * kBorder, kRows = kGroupHeight + 2 * kBorder;
// Counts: pixels | those with two samples << 8 | those with Trend::decay << 16.
shared uint s_counts[kRows * kStride], s_row_counts[kRows * kGroupWidth];
shared vec4 s_moments[kRows * kStride], s_rows[kRows * kGroupWidth]; // value, square, variance, Trend::decay

void load_moments(ivec2 origin) {
  for (uint i = gl_LocalInvocationIndex; i < s_counts.length(); i += 256u) {
    ivec2 p = origin + ivec2(int(i) % kStride, int(i) / kStride) - kBorder;
    s_counts[i] = 0u;
    s_moments[i] = vec4(0.0);
    if (!inside(p)) continue;
    uint at = index_of(p);
    vec2 slow = history[at];
    float a = slow.x, n = slow.y;
    if (!(n > 0.0)) continue;
    precise float square = a * a;
    precise float scaled = greater(moment_of(rest[at].x & 0xffffu) - square, 0.0) * n;
    float spread = quotient(scaled, greater(n - 1.0, 1.0));
    float decay = uintBitsToFloat(rest[at].y & 0xffff0000u);
    s_counts[i] = 1u + (n >= 2.0 ? 1u << 8 : 0u) + (decay > 0.0 ? 1u << 16 : 0u);
    s_moments[i] = vec4(a, square, n >= 2.0 ? spread : 0.0, decay > 0.0 ? decay : 0.0);
  }
}

void sum_rows() {
  for (uint i = gl_LocalInvocationIndex; i < s_row_counts.length(); i += 256u) {
    uint at = i / kGroupWidth * kStride + i % kGroupWidth;
    s_row_counts[i] = s_counts[at] + s_counts[at + 1u] + s_counts[at + 2u] + s_counts[at + 3u] + s_counts[at + 4u];
    precise vec4 sums = ((s_moments[at] + s_moments[at + 1u]) + (s_moments[at + 2u] + s_moments[at + 3u])) +
                        s_moments[at + 4u];
    s_rows[i] = sums;
  }
}

// log2 and exp2 of positive normal numbers, as the CPU approximates them.
float log2_of(float x) {
  int bits = floatBitsToInt(x);
  precise float m = intBitsToFloat((bits & 0x7fffff) | 0x3f800000) - 1.0;
  precise float log = float((bits >> 23) - 127) +
         m * (1.4418256 + m * (-0.7057096 + m * (0.41450846 + m * (-0.19365396 + m * 0.04303296))));
  return log;
}
float exp2_of(float x) { // of x in [-100, 0]
  precise float whole = float(int(x) - 1), f = x - whole;
  precise float m = 1.0 + f * (0.6951786 + f * (0.2276186 + f * 0.0772028));
  precise float scaled = m * intBitsToFloat((int(whole) + 127) << 23);
  return scaled;
}

struct Variance {
  float of_mean; // that the result has
  float told;    // that the filter uses
};

Variance variance_of(vec2 slow, float mean_square, uint counts, vec4 sums, bool moves) {
  float a = slow.x, n = greater(slow.y, 1.0);
  float count = greater(float(counts & 255u), 1.0);
  float spread_seen = float((counts >> 8) & 255u), decay_seen = float(counts >> 16);
  precise float above = greater(sums.y * count - sums.x * sums.x, 0.0), below = count * greater(count - 1.0, 1.0);
  float space = quotient(above, below);
  precise float own = greater(mean_square - a * a, 0.0) * n;
  // The mean of the variance around, with weight prior, and the pixel's own.
  float around = spread_seen > 0.0 ? sums.z : space, divisor = greater(spread_seen, 1.0);
  above = terms.prior * around + own * divisor, below = (terms.prior + n - 1.0) * divisor;
  float both = quotient(above, below);
  precise float spread = n < 2.0 ? space : both;
  spread = moves && n < 4.0 ? greater(spread, 0.5 * space) : spread;
  float mean = quotient(sums.x, count);
  if (terms.per_sample < 1.0) spread = lesser(spread, mean * (1.0 - mean) * terms.most_spread);
  precise float measured = terms.ratio_prior * terms.still_factor * spread + sums.w;
  precise float modelled = (terms.ratio_prior + decay_seen) * spread;
  float factor = has(kStratified) && spread > 0.0 ? quotient(measured, modelled) : terms.still_factor;
  precise float exponent = -terms.still_power * log2_of(n);
  precise float still = factor * exp2_of(exponent);
  precise float moving = terms.moving_base + terms.moving_gain * n;
  float ratio = lesser(moves && n <= terms.longest_moving ? moving : still, 1.0);
  precise float share = quotient(1.0, n), v = spread * (n < 2.0 ? 1.0 : ratio) * share;
  precise float sample_share = share * terms.per_sample;
  precise float told = v * (1.0 + sample_share * (terms.young + terms.distrust * sample_share));
  return slow.y > 0.0 ? Variance(v, told) : Variance(0.0, kMaxVariance * (1.0 + terms.distrust));
}

// --- values of pixels without history ---
const ivec2 kOffsets[4] = ivec2[](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(-1, 1));

vec2 history_at(ivec2 p) { return inside(p) ? history[index_of(p)] : vec2(0.0); }

// Weight and sum of the pixels of the same surface that are 1 << step pixels away.
vec2 sum_of_neighbours(ivec2 p, uint step) {
  vec2 sum = vec2(0.0);
  for (int d = 0; d < 4; ++d)
    for (int side = 0; side < 2; ++side) {
      ivec2 q = p + (side == 0 ? 1 : -1) * (1 << step) * kOffsets[d];
      vec2 there = history_at(q);
      if (!(there.y > 0.0)) continue;
      uint weight = (pair_guides[step * pixel_count() + index_of(side == 0 ? p : q)] >> (8 * d)) & 255u;
      precise float part = float(weight) * there.x;
      if (weight > kLoneGuide) sum += vec2(float(weight), part);
    }
  return sum;
}

float filled_value(ivec2 p) {
  const int window = 8; // kPlaneBorder
  vec2 sum = vec2(0.0);
  for (uint step = 0u; step < 3u && sum.x == 0.0; ++step) sum = sum_of_neighbours(p, step);
  if (sum.x == 0.0)
    for (int y = -window; y <= window; ++y)
      for (int x = -window; x <= window; ++x) {
        vec2 there = history_at(p + ivec2(x, y));
        if (there.y > 0.0) sum += vec2(1.0, there.x);
      }
  return sum.x > 0.0 ? quotient(sum.y, sum.x) : 1.0;
}

void main() {
  ivec2 origin = ivec2(gl_WorkGroupID.xy) * ivec2(kGroupWidth, kGroupHeight), p = ivec2(gl_GlobalInvocationID.xy);
  load_moments(origin);
  barrier();
  sum_rows();
  barrier();
  if (!inside(p)) return;
  uint at = gl_LocalInvocationIndex, counts = 0u, i = index_of(p);
  precise vec4 sums = vec4(0.0);
  for (int r = 0; r < 5; ++r) counts += s_row_counts[at + r * kGroupWidth], sums += s_rows[at + r * kGroupWidth];
  vec2 slow = history[i];
  bool moves = has(kHasHistory) && has(kFollowMotion) && changes[0] != 0u;
  Variance v = variance_of(slow, moment_of(rest[i].x & 0xffffu), counts, sums, moves);
  precise float allowed = 2.0 * terms.noise_tolerance * v.told + 1e-6;
  float root = reciprocal_root(allowed);
  precise float precision_units = lesser(greater(kPrecisionUnits * root + 0.5, 1.0), kMaxPrecision);
  // Resampled histories belong to surfaces.
  bool hit = (has(kFollowMotion) && slow.y > 0.0) || uintBitsToFloat(guides[i].x) > 0.0;
  float value = slow.x;
  if (hit && !(slow.y > 0.0)) {
    value = filled_value(p);
    result[i] = value;
  }
  noisy[i] = in_ao_units(value) | (hit ? uint(precision_units) << 16 : 0u);
  result[pixel_count() + i] = v.of_mean;
}
