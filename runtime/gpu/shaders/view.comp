#version 460
#extension GL_GOOGLE_include_directive : require
// Finds the nearest hits of the rays of a picture's pixels.
#define CLOSEST
#include "trace.glsl"
#include "pixel_rays.glsl"

layout(std430, binding = 11) writeonly restrict buffer Hits { HitRecord hits[]; };

void main() {
  uint i = THREAD;
  if (i >= span.count) return;
  uvec2 p;
  if (!pixel_of_thread(i + span.first, view.width, view.height, p)) return;
  float infinity = uintBitsToFloat(0x7f800000u);
  Best best = Best(0.0, 0.0, 0xffffffffu, 0u, 0u);
  float t = infinity;
  dvec3 origin, direction;
  if (pixel_ray(p, origin, direction)) {
    UnitRay u = unit_ray(vec3(origin), vec3(direction), 0.0, infinity);
    trace(u, best, span.ray_class);
    t = u.tmax;
  }
  bool valid = best.placement != 0xffffffffu;
  hits[p.y * view.width + p.x] =
      HitRecord(valid ? t : infinity, best.u, best.v, best.placement, best.cluster, best.triangle);
}
