#version 460
#extension GL_GOOGLE_include_directive : require
// Corrects the history where the fast one shows a change: sum_windows(), add_windows() and correct_row() of
// runtime/denoise/kernels/history_rows_body.h.
#include "denoise.glsl"

layout(constant_id = 2) const uint kRadius = 4u; // of the window, at most 4

// Shared memory limits how many groups run at once, so each group has many threads.
layout(local_size_x = 32, local_size_y = 16) in;
const uint kThreads = 512u;
layout(std430, binding = 0) readonly restrict buffer Samples { vec2 samples[]; };
layout(std430, binding = 1) restrict buffer History { vec2 history[]; };
layout(std430, binding = 2) restrict buffer Rest { uvec2 rest[]; }; // moments, trend

const int kGroupWidth = 32, kGroupHeight = 16, kBorder = 4; // pixels of a group; border
shared vec2 s_sample[(kGroupHeight + 2 * kBorder) * (kGroupWidth + 2 * kBorder)];
shared uint s_count[(kGroupHeight + 2 * kBorder) * kGroupWidth]; // | of the narrow window << 16
shared vec4 s_sums[(kGroupHeight + 2 * kBorder) * kGroupWidth];  // value, square, change, change of the narrow window

void load_samples(ivec2 origin) {
  const int stride = kGroupWidth + 2 * kBorder;
  for (uint i = gl_LocalInvocationIndex; i < s_sample.length(); i += kThreads) {
    ivec2 p = origin + ivec2(int(i) % stride, int(i) / stride) - kBorder;
    s_sample[i] = inside(p) ? samples[index_of(p)] : vec2(-1.0, 0.0);
  }
}

void sum_rows() {
  for (uint i = gl_LocalInvocationIndex; i < s_count.length(); i += kThreads) {
    uint at = i / kGroupWidth * (kGroupWidth + 2 * kBorder) + i % kGroupWidth + kBorder;
    vec2 c = s_sample[at], l = s_sample[at - 1u], r = s_sample[at + 1u];
    uint narrow = uint(l.x >= 0.0) + uint(c.x >= 0.0) + uint(r.x >= 0.0), count = narrow;
    precise float narrow_change = l.y + c.y + r.y;
    precise float change = narrow_change, value = greater(c.x, 0.0);
    precise float squares = value * value;
    for (uint d = 1u; d <= kRadius; ++d) {
      l = s_sample[at - d], r = s_sample[at + d];
      if (d > 1u) count += uint(l.x >= 0.0) + uint(r.x >= 0.0), change += l.y + r.y;
      float lv = greater(l.x, 0.0), rv = greater(r.x, 0.0);
      value += lv + rv;
      squares += lv * lv + rv * rv;
    }
    s_count[i] = count | (narrow << 16);
    s_sums[i] = vec4(value, squares, change, narrow_change);
  }
}

// Reduces the magnitude of a change by a limit, at most to 0.
float excess(float change, float limit) {
  precise float left = greater(abs(change) - limit, 0.0);
  return change < 0.0 ? -left : left;
}

void correct(ivec2 p, uint at) {
  float count = 0.0, narrow_count = 0.0;
  precise float value = 0.0, squares = 0.0, change = 0.0, narrow_change = 0.0;
  for (uint r = 0u; r <= 2u * kRadius; ++r) {
    uint row = at + (r + kBorder - kRadius) * kGroupWidth;
    uint counts = s_count[row];
    vec4 sums = s_sums[row];
    count += float(counts & 0xffffu);
    value += sums.x, squares += sums.y, change += sums.z;
    if (r + 1u >= kRadius && r <= kRadius + 1u) narrow_count += float(counts >> 16), narrow_change += sums.w;
  }
  float n = greater(count, 1.0);
  precise float mean = quotient(value, n);
  precise float spread = squares - value * mean;
  precise float variance = count > 1.0 ? quotient(greater(spread, 0.0), greater(n - 1.0, 1.0)) : 0.0;
  precise float noise = variance * terms.fast_share;
  float narrow_n = greater(narrow_count, 1.0);
  precise float wide_limit = terms.gamma * rooted(quotient(noise, n)) + terms.change_tolerance;
  precise float narrow_limit = terms.gamma * rooted(quotient(noise, narrow_n)) + terms.change_tolerance;
  float wide = excess(quotient(change, n), wide_limit);
  float narrow = excess(quotient(narrow_change, narrow_n), narrow_limit);
  float wanted = abs(narrow) > abs(wide) ? narrow : wide;
  if (wanted == 0.0) return;

  uint i = index_of(p);
  vec2 slow = history[i];
  uint moments = rest[i].x;
  float old_mean = slow.x;
  precise float new_mean = slow.y > 0.0 ? lesser(greater(old_mean + wanted, 0.0), 1.0) : old_mean;
  precise float shift = new_mean - old_mean;
  if (shift == 0.0) return;
  precise float kept = 1.0 - lesser(terms.response * abs(shift), 1.0);
  precise float frames = lesser(slow.y, greater(slow.y * kept, terms.fast_frames));
  precise float moment = greater(moment_of(moments & 0xffffu) - old_mean * old_mean, 0.0); // a shift keeps the variance
  precise float square = moment + new_mean * new_mean;
  history[i] = vec2(new_mean, frames);
  rest[i] = uvec2(in_moment_units(square) | (moments & 0xffff0000u), 0u);
}

void main() {
  ivec2 origin = ivec2(gl_WorkGroupID.xy) * ivec2(kGroupWidth, kGroupHeight);
  load_samples(origin);
  barrier();
  sum_rows();
  barrier();
  ivec2 p = origin + ivec2(gl_LocalInvocationID.xy);
  if (inside(p)) correct(p, gl_LocalInvocationIndex);
}
