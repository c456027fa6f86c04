#version 460
#extension GL_GOOGLE_include_directive : require
// Guide weights of all pairs that the filter compares: guide_row(), lone_guide_row() and raise_guides_row() of
// runtime/denoise/kernels/filter_rows_body.h.
#include "denoise.glsl"

// Shared memory limits how many groups run at once, so each group has many threads.
layout(local_size_x = 32, local_size_y = 16) in;
const uint kThreads = 512u;
layout(std430, binding = 0) readonly restrict buffer Guides { uvec4 guides[]; };
layout(std430, binding = 1) readonly restrict buffer Changes { uint changes[]; };
layout(std430, binding = 2) writeonly restrict buffer PairGuides { uint pair_guides[]; }; // planes of the steps 1, 2, 4

const int kGroupWidth = 32, kGroupHeight = 16;                   // pixels of a group
const int kSide = 5, kBelow = 5;                    // surfaces outside it that are read; above: 1
const int kStride = kGroupWidth + 2 * kSide, kRows = kGroupHeight + 1 + kBelow;
const int kLoneStride = kGroupWidth + 8, kLoneRows = kGroupHeight + 4;

// dx, dy: change of the disparity per pixel. Normals are read from the cache, for the sake of shared memory.
shared float s_disparity[kRows * kStride], s_dx[kRows * kStride], s_dy[kRows * kStride];
shared uint s_near[kRows * kStride];         // weights of pairs one pixel apart, a byte each, not raised
shared uint s_lone[kLoneRows * kLoneStride]; // from 4 pixels left of the group on

float disparity_at(ivec2 p) { return inside(p) ? uintBitsToFloat(guides[index_of(p)].x) : 0.0; }

// derive_row() of runtime/denoise/depth_derivatives.cpp.
float smaller_difference(float before, float centre, float after) {
  float backward = centre - before, forward = after - centre;
  bool use_backward = before > 0.0 && !(after > 0.0 && abs(forward) < abs(backward));
  float chosen = use_backward ? backward : after > 0.0 ? forward : 0.0;
  return centre > 0.0 ? chosen : 0.0;
}

void load_surfaces(ivec2 origin) {
  for (uint i = gl_LocalInvocationIndex; i < s_dx.length(); i += kThreads) {
    ivec2 p = origin + ivec2(int(i) % kStride - kSide, int(i) / kStride - 1);
    float here = disparity_at(p);
    s_disparity[i] = here;
    s_dx[i] = smaller_difference(disparity_at(p - ivec2(1, 0)), here, disparity_at(p + ivec2(1, 0)));
    s_dy[i] = smaller_difference(disparity_at(p - ivec2(0, 1)), here, disparity_at(p + ivec2(0, 1)));
  }
}

// The normal at a place of which the disparity is not 0.
ivec3 normal_at(int place, ivec2 origin) {
  uvec4 guide = guides[index_of(origin + ivec2(place % kStride - kSide, place / kStride - 1))];
  return normal_of(guide.y, guide.z);
}

// Guide weight of the surfaces at places p and q, q being at an offset from p.
uint guide_weight(int p, int q, vec2 offset) {
  float dp = s_disparity[p], dq = s_disparity[q];
  if (!(dp > 0.0 && dq > 0.0)) return 0u;
  precise float difference = dq - dp;
  precise float rise_p = s_dx[p] * offset.x + s_dy[p] * offset.y, rise_q = s_dx[q] * offset.x + s_dy[q] * offset.y;
  precise float away = greater(abs(difference - rise_p), abs(difference - rise_q));
  precise float least = terms.guide_depth * lesser(dp, dq);
  precise float allowed = least + terms.guide_slope * lesser(abs(rise_p), abs(rise_q)) +
                          lesser(terms.guide_bend * abs(rise_p - rise_q), kMaxBend * least) + 1e-37;
  precise float depth = greater(0.0, 1.0 - away / allowed);
  if (depth == 0.0) return uint(kMinGuide);
  ivec2 origin = ivec2(gl_WorkGroupID.xy) * ivec2(kGroupWidth, kGroupHeight);
  int dot = dot_of(normal_at(p, origin), normal_at(q, origin));
  precise float cosine = lesser(greater(float(dot) * kSquaredNormalUnit, 0.0), 1.0);
  cosine *= cosine;
  cosine *= cosine;
  cosine *= cosine;
  precise float weight = depth * depth * cosine * 255.0 + 0.5;
  return uint(greater(weight, kMinGuide));
}

// The four pairs that begin at a place, as kPairOffsets has them.
uint pair_weights(int p, int apart) {
  float a = float(apart);
  int below = p + apart * kStride;
  return guide_weight(p, p + apart, vec2(a, 0.0)) | (guide_weight(p, below, vec2(0.0, a)) << 8) |
         (guide_weight(p, below + apart, vec2(a, a)) << 16) | (guide_weight(p, below - apart, vec2(-a, a)) << 24);
}

void find_near() {
  for (uint i = gl_LocalInvocationIndex; i < s_near.length(); i += kThreads) {
    int x = int(i) % kStride, y = int(i) / kStride;
    bool wanted = x >= 0 && x < kStride && y < kRows - 1;
    // Pairs that leave the loaded surfaces belong to no pixel whose neighbours count.
    s_near[i] = wanted && x > 0 && x < kStride - 1 ? pair_weights(int(i), 1)
                : wanted && x == 0                 ? guide_weight(int(i), int(i) + 1, vec2(1.0, 0.0)) |
                                         (guide_weight(int(i), int(i) + kStride + 1, vec2(1.0, 1.0)) << 16)
                : wanted                           ? guide_weight(int(i), int(i) + kStride - 1, vec2(-1.0, 1.0)) << 24
                                                   : 0u;
  }
}

uint byte_of(uint word, int i) { return (word >> (8 * i)) & 255u; }

void find_lone() {
  for (uint i = gl_LocalInvocationIndex; i < s_lone.length(); i += kThreads) {
    int at = (int(i) / kLoneStride + 1) * kStride + int(i) % kLoneStride + kSide - 4, above = at - kStride;
    uint here = s_near[at];
    uint company = byte_of(here, 0) + byte_of(s_near[at - 1], 0) + byte_of(here, 1) + byte_of(s_near[above], 1) +
                   byte_of(here, 2) + byte_of(s_near[above - 1], 2) + byte_of(here, 3) + byte_of(s_near[above + 1], 3);
    uint missing = company < kCompany ? kCompany - company : 0u;
    const uint gain = 65536u * kLoneGuide / kCompany + 1u;
    s_lone[i] = s_disparity[at] > 0.0 ? (missing * gain) >> 16 : 0u;
  }
}

uint raised(uint weight, uint p, uint q) { return max(weight, min(p, q)); }

// Weights raised to the lesser loneliness of both pixels.
uint raised_weights(uint weights, int lone, int apart) {
  uint own = s_lone[lone];
  int below = lone + apart * kLoneStride;
  return raised(byte_of(weights, 0), own, s_lone[lone + apart]) |
         (raised(byte_of(weights, 1), own, s_lone[below]) << 8) |
         (raised(byte_of(weights, 2), own, s_lone[below + apart]) << 16) |
         (raised(byte_of(weights, 3), own, s_lone[below - apart]) << 24);
}

void main() {
  if (changes[1] == 0u) return; // the weights are those of the frame before
  ivec2 origin = ivec2(gl_WorkGroupID.xy) * ivec2(kGroupWidth, kGroupHeight);
  load_surfaces(origin);
  barrier();
  find_near();
  barrier();
  find_lone();
  barrier();
  ivec2 local = ivec2(gl_LocalInvocationID.xy), p = origin + local;
  if (!inside(p)) return;
  int at = (local.y + 1) * kStride + local.x + kSide, lone = local.y * kLoneStride + local.x + 4;
  uint i = index_of(p);
  pair_guides[i] = raised_weights(s_near[at], lone, 1);
  pair_guides[pixel_count() + i] = raised_weights(pair_weights(at, 2), lone, 2);
  pair_guides[2u * pixel_count() + i] = raised_weights(pair_weights(at, 4), lone, 4);
}
