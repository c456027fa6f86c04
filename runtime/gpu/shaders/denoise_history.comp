#version 460
#extension GL_GOOGLE_include_directive : require
// Loads a frame's guides, resamples the history where things move, and adds the frame's samples: locate_pixels(),
// interpolate_run(), sharpen_run() and look_nearby() of runtime/denoise/kernels/resample_rows_body.h, accumulate_row() and
// keep_trends_row() of history_rows_body.h.
#include "denoise.glsl"

layout(constant_id = 2) const uint kSquarings = 2u; // that raise cosines to their power

layout(local_size_x = 32, local_size_y = 8) in;
layout(std430, binding = 0) readonly restrict buffer Depths { float view_z[]; };
layout(std430, binding = 1) readonly restrict buffer Normals { float normals[]; };
layout(std430, binding = 2) readonly restrict buffer Instances { uint instances[]; };
layout(std430, binding = 3) readonly restrict buffer Motions { vec2 motions[]; };
layout(std430, binding = 4) readonly restrict buffer PreviousDepths { float previous_z[]; };
layout(std430, binding = 5) readonly restrict buffer Limits { float limits[]; };
layout(std430, binding = 6) readonly restrict buffer Ao { float ao[]; };
layout(std430, binding = 7) readonly restrict buffer Changes { uint changes[]; };
// The same buffers before and now, unless kFollowMotion is set. Histories are two buffers: mean and length; moments and
// trend.
layout(std430, binding = 8) readonly buffer GuidesBefore { uvec4 guides_before[]; };
layout(std430, binding = 9) buffer GuidesNow { uvec4 guides_now[]; };
layout(std430, binding = 10) readonly buffer HistoryBefore { vec2 history_before[]; };
layout(std430, binding = 11) buffer HistoryNow { vec2 history_now[]; };
layout(std430, binding = 12) readonly buffer RestBefore { uvec2 rest_before[]; };
layout(std430, binding = 13) buffer RestNow { uvec2 rest_now[]; };
layout(std430, binding = 14) writeonly restrict buffer Samples { vec2 samples[]; }; // value, or -1; change

struct Past {
  float mean, square, fast, frames;
};

Past past_of(uint i) {
  vec2 a = history_before[i];
  uint moments = rest_before[i].x;
  return Past(a.x, moment_of(moments & 0xffffu), moment_of(moments >> 16), a.y);
}

float disparity_at(ivec2 p) { return inside(p) ? disparity_of(view_z[index_of(p)]) : 0.0; }

// Magnitude of the smaller one-sided difference.
float smaller_step(float before, float centre, float after) {
  float b = before > 0.0 ? abs(centre - before) : kLargest, f = after > 0.0 ? abs(after - centre) : kLargest;
  return (before > 0.0 || after > 0.0) && centre > 0.0 ? lesser(b, f) : 0.0;
}

// Where a pixel's surface was in the frame before.
struct Located {
  bool found;
  ivec2 corner;   // the first of the 2 x 2 pixels around it
  vec2 fraction;
  float disparity, tolerance, longest;
};

Located locate(ivec2 p, float now, vec2 motion, bool still) {
  Located l;
  vec2 from = vec2(p) - (still ? vec2(0.0) : motion);
  precise float before = now;
  bool seen = now > 0.0;
  if (has(kHasPreviousZ)) {
    float z = previous_z[index_of(p)];
    seen = seen && z >= kNearestDepth && z <= kFarthestDepth;
    before = quotient(1.0, lesser(greater(z, kNearestDepth), kFarthestDepth));
  }
  l.found = from.x > -1.0 && from.x < float(terms.width) && from.y > -1.0 && from.y < float(terms.height) && seen;
  vec2 at = l.found ? from : vec2(0.0), whole = floor(at);
  l.corner = ivec2(whole);
  l.fraction = at - whole;
  precise float slope = smaller_step(disparity_at(p - ivec2(1, 0)), now, disparity_at(p + ivec2(1, 0))) +
                smaller_step(disparity_at(p - ivec2(0, 1)), now, disparity_at(p + ivec2(0, 1)));
  if (has(kHasPreviousZ)) slope *= quotient(before, greater(now, kSmallest));
  l.disparity = before;
  precise float tolerance = terms.depth * before + terms.slope * slope + kSmallest;
  l.tolerance = tolerance;
  l.longest = still ? terms.longest_still : terms.longest_moving;
  return l;
}

// Pixels weighted by how well they match.
struct Gathered {
  float weight, mean, frames;
  float square, fast; // in units of 1 / kMomentUnits
};

void gather(inout Gathered sum, ivec2 p, float bilinear, Located l, uvec4 guide, ivec3 normal) {
  if (!inside(p)) return;
  uint i = index_of(p);
  uvec4 other = guides_before[i];
  float there = uintBitsToFloat(other.x);
  precise float away = abs(there - l.disparity);
  precise float cosine =
      lesser(greater(1.1 * kSquaredNormalUnit * float(dot_of(normal_of(other.y, other.z), normal)), 0.0), 1.0);
  for (uint s = 0u; s < kSquarings; ++s) cosine *= cosine;
  vec2 past = history_before[i];
  uint moments = rest_before[i].x;
  bool same = there > 0.0 && past.y > 0.0 && away <= 2.0 * l.tolerance &&
              (!has(kTestInstances) || other.w == guide.w);
  if (!same) return;
  precise float part = bilinear * (quotient(l.tolerance, greater(away, l.tolerance)) * cosine);
  precise float weight = sum.weight + part;
  precise float mean = sum.mean + part * past.x, frames = sum.frames + part * past.y;
  precise float square = sum.square + part * float(moments & 0xffffu), fast = sum.fast + part * float(moments >> 16);
  sum = Gathered(weight, mean, frames, square, fast);
}

// A pixel of the bicubic footprint; `same` becomes false if it is not on the surface.
float tap(ivec2 p, Located l, uint instance, inout bool same) {
  if (!inside(p)) {
    same = false;
    return 0.0;
  }
  uint i = index_of(p);
  vec2 a = history_before[i];
  same = same && guides_before[i].w == instance && a.y > 0.0 &&
         abs(uintBitsToFloat(guides_before[i].x) - l.disparity) <= l.tolerance;
  return a.x;
}

// The difference between Catmull-Rom and linear interpolation.
float sharpening(float before, float a, float b, float after, float t) {
  precise float s = -0.5 * t * (1.0 - t) * ((1.0 - t) * (before - 2.0 * a + b) + t * (a - 2.0 * b + after));
  return s;
}

// The mean with bicubic precision, where the footprint lies on one surface.
float sharpened(float linear, Located l, uint instance) {
  ivec2 p = l.corner;
  float fx = l.fraction.x, fy = l.fraction.y;
  bool same = true;
  float m00 = tap(p, l, instance, same), m10 = tap(p + ivec2(1, 0), l, instance, same);
  float m01 = tap(p + ivec2(0, 1), l, instance, same), m11 = tap(p + ivec2(1, 1), l, instance, same);
  if (!same) return linear;
  float left0 = tap(p + ivec2(-1, 0), l, instance, same), right0 = tap(p + ivec2(2, 0), l, instance, same);
  float left1 = tap(p + ivec2(-1, 1), l, instance, same), right1 = tap(p + ivec2(2, 1), l, instance, same);
  float up0 = tap(p + ivec2(0, -1), l, instance, same), down0 = tap(p + ivec2(0, 2), l, instance, same);
  float up1 = tap(p + ivec2(1, -1), l, instance, same), down1 = tap(p + ivec2(1, 2), l, instance, same);
  if (!same) return linear;
  precise float along_x = (1.0 - fy) * sharpening(left0, m00, m10, right0, fx) + fy * sharpening(left1, m01, m11, right1, fx);
  precise float along_y = (1.0 - fx) * sharpening(up0, m00, m01, down0, fy) + fx * sharpening(up1, m10, m11, down1, fy);
  precise float sharp = linear + (along_x + along_y);
  return lesser(greater(sharp, 0.0), 1.0);
}

// The mean history of the same surface around its previous position; false if there is none.
bool nearby(Located l, uvec4 guide, ivec3 normal, out Past past) {
  const int radius = int(kNearbyRadius);
  ivec2 nearest = ivec2(greaterThanEqual(l.fraction, vec2(0.5)));
  Gathered sum = Gathered(0.0, 0.0, 0.0, 0.0, 0.0);
  for (int y = nearest.y - radius; y <= nearest.y + radius; ++y)
    for (int x = nearest.x - radius; x <= nearest.x + radius; ++x) {
      precise vec2 away = vec2(x, y) - l.fraction;
      precise float near = 1.0 - (away.x * away.x + away.y * away.y) * (1.0 / (kNearbyReach * kNearbyReach));
      precise float weight = near * near;
      if (near > 0.0) gather(sum, l.corner + ivec2(x, y), weight, l, guide, normal);
    }
  past = Past(0.0, 0.0, 0.0, 0.0);
  if (!(sum.weight > kMinHistoryWeight)) return false;
  float scale = quotient(1.0, sum.weight);
  precise float mean = lesser(sum.mean * scale, 1.0);
  precise float square = sum.square * scale * (1.0 / kMomentUnits), fast = sum.fast * scale * (1.0 / kMomentUnits);
  precise float frames = terms.nearby * lesser(sum.frames * scale, terms.longest_moving);
  past = Past(mean, square, fast, frames);
  return true;
}

// @param lost whether the pixel's own history is lost
Past resampled(ivec2 p, uvec4 guide, vec2 motion, bool still, out bool lost) {
  lost = true;
  Located l = locate(p, uintBitsToFloat(guide.x), motion, still);
  if (!l.found) return Past(0.0, 0.0, 0.0, 0.0);
  ivec3 normal = normal_of(guide.y, guide.z);
  float fx = l.fraction.x, fy = l.fraction.y;
  Gathered sum = Gathered(0.0, 0.0, 0.0, 0.0, 0.0);
  precise float w00 = (1.0 - fx) * (1.0 - fy), w10 = fx * (1.0 - fy), w01 = (1.0 - fx) * fy, w11 = fx * fy;
  gather(sum, l.corner, w00, l, guide, normal);
  if (fx > 0.0) gather(sum, l.corner + ivec2(1, 0), w10, l, guide, normal);
  if (fy > 0.0) gather(sum, l.corner + ivec2(0, 1), w01, l, guide, normal);
  if (fx > 0.0 && fy > 0.0) gather(sum, l.corner + ivec2(1, 1), w11, l, guide, normal);
  lost = sum.weight <= kLostWeight;
  if (lost && terms.nearby > 0.0) {
    Past around;
    if (nearby(l, guide, normal, around)) return around;
  }
  if (!(sum.weight > kMinHistoryWeight)) return Past(0.0, 0.0, 0.0, 0.0);
  float scale = quotient(1.0, sum.weight);
  precise float mean = sum.mean * scale;
  precise float mean_square = sum.square * scale * (1.0 / kMomentUnits), fast = sum.fast * scale * (1.0 / kMomentUnits);
  Past past = Past(lesser(mean, 1.0), mean_square, fast, lesser(sum.frames, l.longest));
  if (fx + fy > 0.0 && sum.weight > kMinSharpenWeight) {
    float sharp = sharpened(past.mean, l, guide.w);
    precise float square = past.square + (sharp - past.mean) * (sharp + past.mean); // keeps the variance
    past.square = square;
    past.mean = sharp;
  }
  return past;
}

// next_trend() and crosses_power_of_two() of runtime/denoise/kernels/trend.h.
bool crosses_power_of_two(float n) { return n - uintBitsToFloat(floatBitsToUint(n) & 0x7f800000u) < 1.0; }
uint next_trend(uint bits, float mean, float n) {
  uint half_before = bits & 0xffffu, exponent = (floatBitsToUint(n) >> 23) - 127u;
  float decay_before = uintBitsToFloat(bits & 0xffff0000u), decay = 0.0;
  precise float steps = mean > 0.0 ? mean * kTrendSteps + 0.5 : 0.5;
  if (half_before != 0u && exponent >= 2u && exponent < kTrendGrowth.length()) {
    precise float change = mean - float(half_before - 1u) * (1.0 / kTrendSteps);
    precise float seen = change * change * kTrendGrowth[exponent] * (1.0 / kTrendFactor);
    decay = decay_before > 0.0 ? 0.5 * (decay_before + seen) : seen;
  }
  return ((floatBitsToUint(decay) + 0x8000u) & 0xffff0000u) | (1u + uint(steps));
}

void main() {
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  if (!inside(p)) return;
  uint i = index_of(p);
  uvec4 guide;
  if (has(kKeepGuides)) {
    guide = guides_now[i];
  } else {
    guide = guide_of(view_z[i], vec3(normals[3u * i], normals[3u * i + 1u], normals[3u * i + 2u]), instances[i]);
    guides_now[i] = guide;
  }
  bool moves = has(kFollowMotion) && changes[0] != 0u;
  bool still = true, lost = false;
  Past past = Past(0.0, 0.0, 0.0, 0.0);
  uint trend = 0u;
  if (has(kHasHistory)) {
    trend = rest_before[i].y;
    if (moves) {
      vec2 motion = motions[i];
      still = is_still(motion);
      past = resampled(p, guide, motion, still, lost);
    } else {
      past = past_of(i);
    }
  }
  if (has(kHasLimits)) past.frames = lesser(past.frames, limits[i]);

  float value = ao[i];
  bool valid = value >= 0.0 && value <= kLargest && uintBitsToFloat(guide.x) > 0.0;
  value = valid ? lesser(value, 1.0) : 0.0;
  float count = lesser(past.frames + 1.0, terms.longest);
  float share = valid ? quotient(1.0, count) : 0.0;
  float fast_share = valid ? quotient(1.0, lesser(count, terms.fast_frames)) : 0.0;
  precise float mean = past.mean + (value - past.mean) * share;
  precise float fast = past.fast + (value - past.fast) * fast_share;
  precise float square = past.square + (value * value - past.square) * share;
  float frames = valid ? count : lesser(past.frames, terms.longest);
  if (moves) trend = still && frames > 1.0 && !lost ? trend : 0u;
  if (valid && frames < terms.longest && crosses_power_of_two(frames)) trend = next_trend(trend, mean, frames);
  history_now[i] = vec2(mean, frames);
  rest_now[i] = uvec2(in_moment_units(square) | (in_moment_units(fast) << 16), trend);
  precise float change = fast - mean;
  samples[i] = vec2(valid ? value : -1.0, valid ? change : 0.0);
}
