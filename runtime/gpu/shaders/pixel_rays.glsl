// Rays of a picture's pixels, with the bits of PrimaryCamera::linear_ray() and approach_scene().
#include "blocks.glsl"

layout(std430, binding = 9) readonly restrict buffer Views { ViewRecord view; };
layout(std430, binding = 10) readonly restrict buffer Film { double film[]; }; // x of columns, then y of rows
layout(push_constant) uniform Push { SpanRecord span; }; // of threads

// Sum of the products of two vectors' components, in the CPU's order.
double product(dvec3 a, dvec3 b) {
  precise double x = a.x * b.x, y = a.y * b.y, z = a.z * b.z;
  precise double sum = (x + y) + z;
  return sum;
}

// The camera's linear part times a vector.
dvec3 turned(dvec3 v) {
  dvec3 result;
  [[unroll]] for (int i = 0; i < 3; ++i)
    result[i] = product(dvec3(view.linear[i], view.linear[3 + i], view.linear[6 + i]), v);
  return result;
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

// Makes the ray of a pixel in unit space. Returns false if it misses the scene.
bool pixel_ray(uvec2 p, out dvec3 origin, out dvec3 direction) {
  dvec3 on_film = dvec3(film[p.x], film[view.width + p.y], 0.0lf);
  bool orthographic = view.orthographic != 0u;
  dvec3 way = turned(orthographic ? dvec3(0.0lf, 0.0lf, 1.0lf) : dvec3(on_film.xy, 1.0lf));
  double shortened = refined_quotient(1.0lf, refined_root(product(way, way)));
  precise dvec3 unit = way * shortened;
  precise dvec3 from = turned(orthographic ? on_film : dvec3(0.0lf)) + dvec3(view.eye[0], view.eye[1], view.eye[2]);
  precise dvec3 centred = from - dvec3(view.centre[0], view.centre[1], view.centre[2]);
  precise dvec3 in_unit_space = centred * view.scale;
  origin = in_unit_space;
  direction = unit;
  return approach_scene(origin, direction);
}
