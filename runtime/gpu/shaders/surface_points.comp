#version 460
#extension GL_GOOGLE_include_directive : require
// Makes the points from which occlusion rays start, of camera rays' hits: in blocks of 8 x 4 pixels, with the geometric
// normal. For benchmarks; pictures take theirs from the G-buffer.
#include "scene.glsl"
#include "blocks.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 9) readonly restrict buffer Cameras { CameraRecord camera; };
layout(std430, binding = 10) readonly restrict buffer Hits { HitRecord hits[]; };
layout(std430, binding = 11) readonly restrict buffer Rays { RayRecord rays[]; };
layout(std430, binding = 12) writeonly restrict buffer Points { PointRecord points[]; };
layout(push_constant) uniform Push { SpanRecord span; }; // of points; reserved: lift off the surface as float bits

PointRecord make_point(uint at, uvec2 p) {
  float[3] zero = float[3](0.0, 0.0, 0.0);
  PointRecord none = PointRecord(zero, zero, zero, kNoPoint, p.x, p.y);
  HitRecord h = hits[at];
  if (h.placement == 0xffffffffu) return none;
  Cluster c = read_cluster(h.cluster);
  uvec2 lead;
  Walk w = begin_walk(c, h.triangle, lead);
  if ((w.restarts & 1u) != 0u) {
    lead.x = next_number(c, w);
    lead.y = next_number(c, w);
  }
  vec3 a = position(c, lead.x), b = position(c, lead.y), e = position(c, next_number(c, w));
  dvec3 g = cross(dvec3(b) - dvec3(a), dvec3(e) - dvec3(a)), n;
  for (int i = 0; i < 3; ++i)
    n[i] = placements[h.placement].grid_from_unit[3 * i] * g.x + placements[h.placement].grid_from_unit[3 * i + 1] * g.y +
           placements[h.placement].grid_from_unit[3 * i + 2] * g.z;
  double size = length(n);
  if (!(size > 0.0lf)) return none;
  n /= size;
  dvec3 d = dvec3(rays[at].direction[0], rays[at].direction[1], rays[at].direction[2]);
  if (dot(n, d) > 0.0lf) n = -n;
  dvec3 o = dvec3(rays[at].origin[0], rays[at].origin[1], rays[at].origin[2]) + d * double(h.t) +
            n * double(uintBitsToFloat(span.reserved));
  vec3 origin = vec3(o), up = vec3(n);
  float[3] normal = float[3](up.x, up.y, up.z);
  return PointRecord(float[3](origin.x, origin.y, origin.z), normal, normal, at, p.x, p.y);
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= span.count) return;
  i += span.first;
  uvec2 p;
  if (pixel_of_thread(i, camera.width, camera.height, p)) {
    points[i] = make_point(p.y * camera.width + p.x, p);
  } else {
    float[3] zero = float[3](0.0, 0.0, 0.0);
    points[i] = PointRecord(zero, zero, zero, kNoPoint, p.x, p.y);
  }
}
