#version 460
#extension GL_GOOGLE_include_directive : require
// A pass of the filter with pairs STEP pixels apart; FIRST: the first one, in which lone samples give way. compare_row(),
// weigh_row(), normalise_row(), exchange_row() and raise_precisions() of runtime/denoise/kernels/filter_rows_body.h.
#include "denoise.glsl"

// Shared memory limits how many groups run at once, so each group has many threads.
const uint kThreads = STEP == 4 ? 1024u : 512u;
#if STEP == 4
layout(local_size_x = 32, local_size_y = 32) in;
#else
layout(local_size_x = 32, local_size_y = 16) in;
#endif
layout(std430, binding = 0) readonly restrict buffer Noisy { uint noisy_in[]; };
layout(std430, binding = 1) writeonly restrict buffer Filtered { uint noisy_out[]; };
layout(std430, binding = 2) readonly restrict buffer PairGuides { uint pair_guides[]; };
layout(std430, binding = 3) readonly restrict buffer History { vec2 history[]; };
layout(std430, binding = 4) restrict buffer Result { float result[]; };
#include "denoise_finish.glsl"

// Pixels of a group. Values are read up to 2 STEP + 1 pixels outside it, weights up to 2 STEP, divisors up to STEP.
const int kGroupWidth = 32, kGroupHeight = 16;
const int kBorder = 2 * STEP + 1;
const int kStride = kGroupWidth + 2 * kBorder, kRows = kGroupHeight + 2 * kBorder;
// Of weights; rows end STEP below the group.
const int kPairStride = kGroupWidth + 4 * STEP, kPairRows = kGroupHeight + 3 * STEP;
const int kScaleStride = kGroupWidth + 2 * STEP, kScaleRows = kGroupHeight + 2 * STEP;
const int kDistanceRows = kPairRows + 2;

shared uint s_noisy[kRows * kStride];             // value | precision << 16
shared uvec2 s_distance[kDistanceRows * kStride]; // of the pairs that begin at a place, two a word; then 1 / D
shared uvec2 s_weight[kPairRows * kPairStride];   // likewise

void load_noisy(ivec2 origin) {
  for (uint i = gl_LocalInvocationIndex; i < s_noisy.length(); i += kThreads) {
    ivec2 p = origin + ivec2(int(i) % kStride, int(i) / kStride) - kBorder;
    s_noisy[i] = inside(p) ? noisy_in[index_of(p)] : 0u;
  }
}

// Squared difference of a pair's values relative to its variance, in fixed point.
uint distance_of(uint p, uint q) {
  uint pp = p >> 16, pq = q >> 16, least = min(pp, pq), most = max(pp, pq);
  uint precision_of_pair = min(mean_up(least, mean_up(least, most)), least + (least >> 2) + (least >> 3));
  if (precision_of_pair == 0u) return terms.no_distance;
  uint difference = uint(abs(int(q & 0xffffu) - int(p & 0xffffu)));
  uint deviations = min(product(difference << 1, precision_of_pair), kMaxDeviations);
  return (deviations * (deviations + 1u)) >> 3;
}

void compare() {
  for (uint i = gl_LocalInvocationIndex; i < s_distance.length(); i += kThreads) {
    // Where the other end was not loaded, the pair belongs to no pixel of the group.
    uint right = i + STEP, below = i + STEP * kStride;
    uint p = s_noisy[i];
    uint last = kRows * kStride - 1;
    uvec4 d = uvec4(distance_of(p, s_noisy[right]), distance_of(p, s_noisy[below]),
                    distance_of(p, s_noisy[min(below + STEP, last)]), distance_of(p, s_noisy[below - STEP]));
    s_distance[i] = uvec2(d.x | (d.y << 16), d.z | (d.w << 16));
  }
}

// Weight of a pair from the sum of nine distances.
uint weight_of(uint sum, uint guide, uint gain) {
  uint nothing = 9u * terms.no_distance;
  uint excess = min(max(sum, nothing) - nothing, terms.limit >> terms.shift);
  uint left = terms.limit - (excess << terms.shift);
  uint kept = left + product(left, terms.stretch), square = product(kept, kept);
  return product(product(square, square), guide * gain);
}

void weigh(ivec2 origin, uint plane) {
  for (uint i = gl_LocalInvocationIndex; i < s_weight.length(); i += kThreads) {
    ivec2 local = ivec2(int(i) % kPairStride, int(i) / kPairStride), p = origin + local - 2 * STEP;
    s_weight[i] = uvec2(0u);
    if (!inside(p)) continue;
    uint guides = pair_guides[plane * pixel_count() + index_of(p)];
    if (guides == 0u) continue;
    uint at = local.y * kStride + local.x; // the first of the 3 x 3 pairs
    uvec2 sum = uvec2(0u); // of two distances a word, which do not overflow
    for (uint y = 0u; y < 3u; ++y, at += kStride) sum += s_distance[at] + s_distance[at + 1u] + s_distance[at + 2u];
    s_weight[i] = uvec2(weight_of(sum.x & 0xffffu, guides & 255u, kStraight) |
                            (weight_of(sum.x >> 16, (guides >> 8) & 255u, kStraight) << 16),
                        weight_of(sum.y & 0xffffu, (guides >> 16) & 255u, kDiagonal) |
                            (weight_of(sum.y >> 16, guides >> 24, kDiagonal) << 16));
  }
}

// Weights of the eight pairs of a pixel.
struct Neighbours {
  uint right, left, down, up, down_right, up_left, down_left, up_right;
};
// @param at place of s_weight
Neighbours neighbours_of(uint at) {
  const uint up = STEP * kPairStride;
  uvec2 own = s_weight[at];
  return Neighbours(own.x & 0xffffu, s_weight[at - STEP].x & 0xffffu, own.x >> 16, s_weight[at - up].x >> 16,
                    own.y & 0xffffu, s_weight[at - up - STEP].y & 0xffffu, own.y >> 16,
                    s_weight[at - up + STEP].y >> 16);
}

uint mean_of(Neighbours n) {
  return mean_up(mean_up(mean_up(n.right, n.left), mean_up(n.down, n.up)),
                 mean_up(mean_up(n.down_right, n.up_left), mean_up(n.down_left, n.up_right)));
}
// The largest weight in units of its gain.
uint largest_of(Neighbours n) {
  const uint stretch = 65536u * (65535u - 255u * kStraight) / (255u * kStraight);
  uint straight = max(max(n.right, n.left), max(n.down, n.up));
  uint diagonal = max(max(n.down_right, n.up_left), max(n.down_left, n.up_right));
  return max(straight + product(straight, stretch), diagonal << 1);
}

void normalise(ivec2 origin) {
  for (uint i = gl_LocalInvocationIndex; i < kScaleRows * kScaleStride; i += kThreads) {
    ivec2 local = ivec2(int(i) % kScaleStride, int(i) / kScaleStride);
    Neighbours n = neighbours_of((local.y + STEP) * kPairStride + local.x + STEP);
#ifdef FIRST
    ivec2 p = origin + local - STEP;
    float frames = inside(p) ? greater(history[index_of(p)].y, 1.0) : 1.0;
    precise float lone = 8192.0 * (kLoneBase + kLoneYoung * (1.0 / frames * terms.per_sample));
    uint own = 8192u - product(65535u - largest_of(n), uint(lone));
    s_distance[i].x = uint(8192.0 * 8192.0 / float(max(own + mean_of(n), 1025u))); // in units of 2^-13
#else
    s_distance[i].x = uint(8192.0 * 32768.0 / float(mean_of(n) + 8192u)); // in units of 2^-15
#endif
  }
}

struct Exchange {
  int value, flux;
  uint scale, taken, squares;
};
void exchange_with(inout Exchange e, uint weight, int noisy, int scale) {
  uint u = product(weight, min(e.scale, s_distance[scale].x));
#ifdef FIRST
  u <<= 2;
#endif
  e.flux += (int(u) * (int(s_noisy[noisy] & 0xffffu) - e.value) + 0x4000) >> 15;
  e.taken += u;
  e.squares += product(u, u);
}

// The pixel's value and precision after the pass.
uint exchanged(ivec2 local) {
  int at = (local.y + kBorder) * kStride + local.x + kBorder;
  int scale = (local.y + STEP) * kScaleStride + local.x + STEP;
  Neighbours n = neighbours_of((local.y + 2 * STEP) * kPairStride + local.x + 2 * STEP);
  Exchange e = Exchange(int(s_noisy[at] & 0xffffu), 0, s_distance[scale].x, 0u, 0u);
  const int row = STEP * kStride, scale_row = STEP * kScaleStride;
  exchange_with(e, n.right, at + STEP, scale + STEP);
  exchange_with(e, n.left, at - STEP, scale - STEP);
  exchange_with(e, n.down, at + row, scale + scale_row);
  exchange_with(e, n.up, at - row, scale - scale_row);
  exchange_with(e, n.down_right, at + row + STEP, scale + scale_row + STEP);
  exchange_with(e, n.up_left, at - row - STEP, scale - scale_row - STEP);
  exchange_with(e, n.down_left, at + row - STEP, scale + scale_row - STEP);
  exchange_with(e, n.up_right, at - row + STEP, scale - scale_row + STEP);
  uint kept = 32768u - e.taken;
  precise float left = float(product(kept, kept) + e.squares) * (1.0 / 16384.0); // of the variance
  precise float raised = float(s_noisy[at] >> 16) * greater(reciprocal_root(left), 1.0);
  return uint(clamp(e.value + e.flux, 0, 32767)) | (uint(lesser(raised + 0.5, kMaxPrecision)) << 16);
}

void main() {
  ivec2 origin = ivec2(gl_WorkGroupID.xy) * ivec2(kGroupWidth, kGroupHeight);
  load_noisy(origin);
  barrier();
  compare();
  barrier();
  weigh(origin, STEP / 2u); // planes of the steps 1, 2, 4
  barrier();
  normalise(origin);
  barrier();
  ivec2 local = ivec2(gl_LocalInvocationID.xy), p = origin + local;
  if (local.y >= kGroupHeight || !inside(p)) return;
  uint noisy = exchanged(local);
  if (has(kLastPass))
    finish(index_of(p), noisy);
  else
    noisy_out[index_of(p)] = noisy;
}
