#version 460
#extension GL_GOOGLE_include_directive : require
// Makes the rays of a picture's pixels and finds their nearest hits. The rays have the bits of
// PrimaryCamera::linear_ray() and approach_scene().
#define CLOSEST
#include "trace.glsl"

layout(std430, binding = 9) readonly restrict buffer Views { ViewRecord view; };
layout(std430, binding = 10) readonly restrict buffer Film { double film[]; }; // x of columns, then y of rows
layout(std430, binding = 11) writeonly restrict buffer Hits { HitRecord hits[]; };
layout(push_constant) uniform Push { SpanRecord span; }; // of threads

// The camera's linear part times a vector.
dvec3 turned(dvec3 v) {
  dvec3 result;
  [[unroll]] for (int i = 0; i < 3; ++i) {
    precise double x = view.linear[i] * v.x, y = view.linear[3 + i] * v.y, z = view.linear[6 + i] * v.z;
    precise double sum = (x + y) + z;
    result[i] = sum;
  }
  return result;
}
double product(dvec3 a, dvec3 b) {
  precise double x = a.x * b.x, y = a.y * b.y, z = a.z * b.z;
  precise double sum = (x + y) + z;
  return sum;
}

// Moves an origin far away to just before the scene. Returns false if the ray misses it.
bool approach_scene(inout dvec3 origin, dvec3 direction) {
  double nearest = view.near_ * view.near_; // a power of two
  if (product(origin, origin) <= nearest) return true;
  double closest = -product(origin, direction);
  precise dvec3 way = direction * closest;
  precise dvec3 point = origin + way;
  if (!(closest > 0.0lf && product(point, point) <= nearest)) return false;
  precise dvec3 back = direction * view.near_;
  precise dvec3 moved = point - back;
  origin = moved;
  return true;
}

void main() {
  uint i = THREAD;
  if (i >= span.count) return;
  i += span.first;
  // Blocks of 8 x 4 pixels; those at the right and lower edge are not full.
  uint block = i >> 5, in_block = i & 31u, per_row = (view.width + 7u) / 8u;
  uvec2 p = uvec2((block % per_row) * 8u + (in_block & 7u), (block / per_row) * 4u + (in_block >> 3));
  if (p.x >= view.width || p.y >= view.height) return;
  dvec3 on_film = dvec3(film[p.x], film[view.width + p.y], 0.0lf);
  bool orthographic = view.orthographic != 0u;
  dvec3 way = turned(orthographic ? dvec3(0.0lf, 0.0lf, 1.0lf) : dvec3(on_film.xy, 1.0lf));
  double shortened = refined_quotient(1.0lf, refined_root(product(way, way)));
  precise dvec3 direction = way * shortened;
  precise dvec3 from = turned(orthographic ? on_film : dvec3(0.0lf)) + dvec3(view.eye[0], view.eye[1], view.eye[2]);
  precise dvec3 centred = from - dvec3(view.centre[0], view.centre[1], view.centre[2]);
  precise dvec3 origin = centred * view.scale;
  float infinity = uintBitsToFloat(0x7f800000u);
  Best best = Best(0.0, 0.0, 0xffffffffu, 0u, 0u);
  float t = infinity;
  if (approach_scene(origin, direction)) {
    UnitRay u = unit_ray(vec3(origin), vec3(direction), 0.0, infinity);
    trace(u, best, span.ray_class);
    t = u.tmax;
  }
  bool valid = best.placement != 0xffffffffu;
  hits[p.y * view.width + p.x] =
      HitRecord(valid ? t : infinity, best.u, best.v, best.placement, best.cluster, best.triangle);
}
