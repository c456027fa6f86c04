#version 460
#extension GL_GOOGLE_include_directive : require
// Counts the occlusion rays that hit something, for each point. A thread walks its rays alone, which are made here; 32
// neighbouring threads take the same samples of neighbouring points.
#include "trace.glsl"
#include "points.glsl"

layout(std430, binding = 10) buffer Counts { uint counts[]; }; // the last word: 1 if a driver ended the loop over samples

void main() {
  uint parts = (push.sample_count + push.per_thread - 1u) / push.per_thread; // threads of a point
  uint block = THREAD / 32u, i = block / parts * 32u + (THREAD & 31u);
  if (i >= push.point_count) return;
  i += push.first_point;
  Point p = read_point(i);
  if (p.pixel == kNoPoint || !(push.tfar > 0.0)) return;
  uint first = (block % parts) * push.per_thread, end = min(first + push.per_thread, push.sample_count), count = 0u;
  uint s = first;
  for (; s < end; ++s) {
    UnitRay u = unit_ray(p.origin, sample_direction(p, push.first_sample + s), 0.0, push.tfar);
    Best best = Best(0.0, 0.0, 0u, 0u, 0u);
    if (trace(u, best, kOcclusionClass)) ++count;
  }
  if (s < end) atomicMax(counts[counts.length() - 1], 1u); // Mesa's CPU device ends loops after 65,535 iterations
  if (count != 0u) atomicAdd(counts[i], count);
}
