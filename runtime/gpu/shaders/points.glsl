// Surface points and their occlusion rays.
#include "sampling.glsl"

layout(std430, binding = 9) readonly restrict buffer Points { PointRecord points[]; };
layout(push_constant) uniform Push { OcclusionRecord push; };

struct Point {
  vec3 origin, up, normal;
  uint pixel, x_px, y_px;
};
Point read_point(uint i) {
  PointRecord p = points[i];
  return Point(vec3(p.origin[0], p.origin[1], p.origin[2]), vec3(p.up[0], p.up[1], p.up[2]),
               vec3(p.normal[0], p.normal[1], p.normal[2]), p.pixel, p.x_px, p.y_px);
}
vec3 sample_direction(Point p, uint s) {
  vec2 at = push.order == kNetOrder ? net_point(push.seed, p.x_px, p.y_px, s) : stratum_point(push.order, p.pixel, s);
  return occlusion_direction(at, p.up, p.normal);
}
