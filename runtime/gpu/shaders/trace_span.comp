#version 460
#extension GL_GOOGLE_include_directive : require
// Traces a span of rays. CLOSEST: nearest hits, else any hits.
#include "trace.glsl"

layout(std430, binding = 9) readonly restrict buffer Rays { RayRecord rays[]; };
#ifdef CLOSEST
layout(std430, binding = 10) writeonly restrict buffer Hits { HitRecord hits[]; };
#else
layout(std430, binding = 10) writeonly restrict buffer Occluded { uint occluded[]; };
#endif
layout(push_constant) uniform Push { SpanRecord span; };

void main() {
  uint i = THREAD;
  if (i >= span.count) return;
  i += span.first;
  UnitRay u = unit_ray(vec3(rays[i].origin[0], rays[i].origin[1], rays[i].origin[2]),
                       vec3(rays[i].direction[0], rays[i].direction[1], rays[i].direction[2]), rays[i].tnear, rays[i].tfar);
  Best best = Best(0.0, 0.0, 0xffffffffu, 0u, 0u);
  bool hit = rays[i].tfar > rays[i].tnear && trace(u, best, span.ray_class);
#ifdef CLOSEST
  bool valid = best.placement != 0xffffffffu;
  hits[i] = HitRecord(valid ? u.tmax : uintBitsToFloat(0x7f800000u), best.u, best.v, best.placement, best.cluster,
                      best.triangle);
#else
  occluded[i] = hit ? 1u : 0u;
#endif
}
