#version 460
#extension GL_GOOGLE_include_directive : require
// Makes camera rays and finds their nearest hits.
#define CLOSEST
#include "trace.glsl"
#include "blocks.glsl"

layout(std430, binding = 9) readonly restrict buffer Cameras { CameraRecord camera; };
layout(std430, binding = 10) writeonly restrict buffer Hits { HitRecord hits[]; };
layout(std430, binding = 11) writeonly restrict buffer Rays { RayRecord rays[]; };
layout(push_constant) uniform Push { SpanRecord span; }; // of threads; ray_class; reserved: 1 writes rays

void main() {
  uint i = THREAD;
  if (i >= span.count) return;
  i += span.first;
  uvec2 p;
  if (!pixel_of_thread(i, camera.width, camera.height, p)) return;
  precise dvec3 d = dvec3(camera.corner[0], camera.corner[1], camera.corner[2]) +
                    dvec3(camera.right[0], camera.right[1], camera.right[2]) * double(p.x) +
                    dvec3(camera.down[0], camera.down[1], camera.down[2]) * double(p.y);
  vec3 direction = vec3(normalize(d)), origin = vec3(camera.eye[0], camera.eye[1], camera.eye[2]);
  float infinity = uintBitsToFloat(0x7f800000u);
  UnitRay u = unit_ray(origin, direction, 0.0, infinity);
  Best best = Best(0.0, 0.0, 0xffffffffu, 0u, 0u);
  trace(u, best, span.ray_class);
  bool valid = best.placement != 0xffffffffu;
  uint at = p.y * camera.width + p.x;
  hits[at] = HitRecord(valid ? u.tmax : infinity, best.u, best.v, best.placement, best.cluster, best.triangle);
  if (span.reserved != 0u)
    rays[at] = RayRecord(float[3](origin.x, origin.y, origin.z), 0.0, float[3](direction.x, direction.y, direction.z),
                         infinity);
}
