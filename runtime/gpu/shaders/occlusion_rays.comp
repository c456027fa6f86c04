#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the occlusion rays of one sample of each point, for tests.
#include "scene.glsl"
#include "points.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 11) writeonly restrict buffer Rays { RayRecord rays[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.point_count) return;
  i += push.first_point;
  Point p = read_point(i);
  vec3 d = p.pixel == kNoPoint ? vec3(0.0) : sample_direction(p, push.first_sample);
  rays[i] = RayRecord(float[3](p.origin.x, p.origin.y, p.origin.z), 0.0, float[3](d.x, d.y, d.z),
                      p.pixel == kNoPoint ? -1.0 : push.tfar);
}
