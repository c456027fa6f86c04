#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the points' sums to their pixels, as trace_view_occlusion() does.
#include "records.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Points { PointRecord points[]; };
layout(std430, binding = 1) readonly restrict buffer Counts { uint counts[]; };
layout(std430, binding = 2) readonly restrict buffer Sums { double sums[]; }; // visibility and distance
layout(std430, binding = 3) writeonly restrict buffer Image { float image[]; }; // AO, then distances
layout(push_constant) uniform Push { OcclusionImageRecord push; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.point_count) return;
  uint pixel = points[i].pixel;
  if (pixel == kNoPoint) return;
  precise double visibility, away;
  if (push.nearest != 0u) {
    visibility = sums[2u * i];
    away = sums[2u * i + 1u];
  } else {
    visibility = double(push.sample_count - counts[i]);
    away = visibility + 0.5lf * double(counts[i]);
  }
  precise double mean = visibility * push.per_sample, mean_away = away * push.per_sample * push.radius;
  image[pixel] = float(mean);
  image[push.pixel_count + pixel] = float(mean_away);
}
