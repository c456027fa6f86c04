#version 460
#extension GL_GOOGLE_include_directive : require
// Sums the visibility and the distance of occlusion rays up, sample by sample: VisibilityCurve and add_samples(), the
// same bits. Rays are made here; a thread has a point.
#define CLOSEST
#include "trace.glsl"
#include "points.glsl"
#include "visibility.glsl"

void main() {
  uint i = THREAD;
  if (i >= push.point_count) return;
  i += push.first_point;
  Point p = read_point(i);
  if (p.pixel == kNoPoint) return;
  for (uint s = 0u; s < push.sample_count; ++s) {
    UnitRay u = unit_ray(p.origin, sample_direction(p, push.first_sample + s), 0.0, push.tfar);
    Best best = Best(0.0, 0.0, 0xffffffffu, 0u, 0u);
    if (push.tfar > 0.0) trace(u, best, kOcclusionClass);
    add_sample(i, best.placement != 0xffffffffu, u.tmax);
  }
}
