#version 460
#extension GL_GOOGLE_include_directive : require
// Makes the channels of a G-buffer from the hits of a picture's camera rays: PrimaryTracer and ray_columns.cpp, the same
// operations in the same order.
#include "scene.glsl"
#include "normals.glsl"
#include "pixel_rays.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 11) readonly restrict buffer Hits { HitRecord hits[]; };
layout(std430, binding = 12) readonly restrict buffer Instances { InstanceSurface instances[]; };
layout(std430, binding = 14) writeonly restrict buffer Planes { uint planes[]; }; // kViewZPlane and others
layout(std430, binding = 15) readonly restrict buffer SurfaceViews { SurfaceViewRecord surface_view; };

dmat3 linear_part(uint instance) {
  dmat3 m;
  [[unroll]] for (int i = 0; i < 9; ++i) m[i / 3][i % 3] = instances[instance].unit_from_surface[i];
  return m;
}
// The product m v, summed in the CPU's order.
dvec3 times(dmat3 m, dvec3 v) {
  precise dvec3 x = m[0] * v.x, y = m[1] * v.y, z = m[2] * v.z;
  precise dvec3 sum = (x + y) + z;
  return sum;
}
dvec3 crossed(dvec3 a, dvec3 b) {
  precise dvec3 m = a.yzx * b.zxy, n = b.yzx * a.zxy, difference = m - n;
  return difference;
}
// The matrix that transforms normals: the cofactor matrix, as normal_matrix() on the CPU.
dmat3 normal_matrix(dmat3 m) {
  dmat3 cofactor = dmat3(crossed(m[1], m[2]), crossed(m[2], m[0]), crossed(m[0], m[1]));
  return product(m[0], cofactor[0]) < 0.0lf ? -cofactor : cofactor;
}
double largest_of(dvec3 v) { return max(max(v.x, v.y), v.z); }

// The unit normal that faces the ray's origin; the reversed direction if the triangle has no area.
dvec3 facing_normal(dvec3 normal, dvec3 direction) {
  double size = refined_root(product(normal, normal));
  if (!(size > 0.0lf)) return -direction;
  double scaled = refined_quotient(product(normal, direction) > 0.0lf ? -1.0lf : 1.0lf, size);
  precise dvec3 unit = normal * scaled;
  return unit;
}

// Where the ray meets the surface's plane, if that is close to the point of the barycentrics; else that point.
dvec3 on_ray(dvec3 origin, dvec3 direction, dvec3 from_barycentrics, dvec3 normal) {
  const double kMinCosine = 1e-3lf;
  const double kMaxMove = 1.0lf; // in unit space, whose half size is 2^20
  double cosine = product(normal, direction);
  precise dvec3 way = from_barycentrics - origin;
  double t = refined_quotient(product(normal, way), cosine);
  precise dvec3 step = direction * t;
  precise dvec3 point = origin + step;
  precise dvec3 move = point - from_barycentrics;
  return cosine < -kMinCosine && product(move, move) <= kMaxMove * kMaxMove ? point : from_barycentrics;
}

// The offset of ray origins along the normal, in world units: ray_offset().
double lift(dvec3 position, dvec3 normal, dvec3 world, dmat3 unit_from_surface, dvec3 largest_vertex) {
  const double kEpsilon = 1.0lf / 8388608.0lf, kUlps = 4.0lf;
  dvec3 moved;
  [[unroll]] for (int i = 0; i < 3; ++i) moved[i] = abs(product(unit_from_surface[i], normal));
  double surface = product(moved, largest_vertex);
  precise dvec3 in_world = abs(world) * view.scale;
  precise double above = surface + product(abs(normal), max(abs(position), in_world));
  precise double scaled = kUlps * above;
  precise double sum = scaled + largest_of(in_world);
  precise double offset = kEpsilon * sum;
  precise double in_units = offset * surface_view.inverse_scale;
  return in_units;
}

vec3 shading_normal(uint instance, bool has_normal, vec3 object_normal, dvec3 geometric) {
  if (!has_normal) return vec3(geometric);
  dmat3 object;
  [[unroll]] for (int i = 0; i < 9; ++i) object[i / 3][i % 3] = double(instances[instance].world_from_object[i]);
  dvec3 normal = times(normal_matrix(object), dvec3(object_normal));
  double size = refined_root(product(normal, normal));
  if (!(size > 0.0lf)) return vec3(geometric);
  double scaled = refined_quotient(product(normal, geometric) < 0.0lf ? -1.0lf : 1.0lf, size);
  precise dvec3 unit = normal * scaled;
  return vec3(unit);
}

// The motion vector in pixels, and the depth in the previous frame, of a point at rest: move_with_camera().
vec3 motion_of(uvec2 p, dvec3 world) {
  dvec3 c = dvec3(0.0lf);
  [[unroll]] for (int i = 0; i < 3; ++i) {
    precise double sum = product(dvec3(surface_view.before[i], surface_view.before[3 + i], surface_view.before[6 + i]), world) +
                         surface_view.before[9 + i];
    c[i] = sum;
  }
  precise double depth = c.z * surface_view.before_depth_scale;
  dvec2 film_point = c.xy;
  if (surface_view.before_orthographic == 0u) {
    if (!(depth > 0.0lf)) return vec3(float(surface_view.no_motion_px), float(surface_view.no_motion_px), 0.0);
    film_point = dvec2(refined_quotient(c.x, c.z), refined_quotient(c.y, c.z));
  }
  dvec2 motion;
  [[unroll]] for (int i = 0; i < 2; ++i) {
    precise double from_edge = film_point[i] - surface_view.window[i];
    double share = refined_quotient(from_edge, surface_view.window[2 + i]);
    precise double then = share * surface_view.size[i];
    precise double pixel = then - surface_view.offset_px[i];
    precise double moved = (double(p[i]) + 0.5lf) - pixel;
    motion[i] = min(max(moved, -surface_view.no_motion_px), surface_view.no_motion_px);
  }
  return vec3(vec2(motion), float(depth));
}

void write(uint plane, uint pixel, float value) {
  planes[plane * view.width * view.height + pixel] = floatBitsToUint(value);
}
void write(uint plane, uint pixel, vec3 value) {
  uint at = plane * view.width * view.height + 3u * pixel;
  [[unroll]] for (uint i = 0u; i < 3u; ++i) planes[at + i] = floatBitsToUint(value[i]);
}
void write_instance(uint pixel, uint instance) { planes[kInstancePlane * view.width * view.height + pixel] = instance; }
void write_motion(uint pixel, vec3 motion) {
  uint n = view.width * view.height, at = kMotionPlane * n + 2u * pixel;
  planes[at] = floatBitsToUint(motion.x);
  planes[at + 1u] = floatBitsToUint(motion.y);
  planes[kPreviousZPlane * n + pixel] = floatBitsToUint(motion.z);
}

void write_miss(uint pixel) {
  write(kViewZPlane, pixel, 0.0);
  write(kNormalPlane, pixel, vec3(0.0));
  write(kPositionPlane, pixel, vec3(0.0));
  write(kGeometricPlane, pixel, vec3(0.0));
  write(kOffsetPlane, pixel, 0.0);
  write_instance(pixel, kNoInstance);
  write_motion(pixel, vec3(0.0));
}

void write_hit(uvec2 p, uint pixel, HitRecord h) {
  dvec3 origin, direction;
  pixel_ray(p, origin, direction);
  Cluster c = read_cluster(h.cluster);
  NormalRecord normals = normal_record(h.cluster);
  uint placed = lookup[h.placement], instance = placed != kNoInstance ? placed : normals.instance;
  uvec3 corners = triangle_vertices(c, h.triangle);
  dvec3 v0 = dvec3(position(c, corners.x)), v1 = dvec3(position(c, corners.y)), v2 = dvec3(position(c, corners.z));
  precise dvec3 e1 = v1 - v0, e2 = v2 - v0;
  precise dvec3 u = e1 * double(h.u), v = e2 * double(h.v), on_surface = (v0 + u) + v;
  dmat3 unit_from_surface = linear_part(instance);
  precise dvec3 from_barycentrics =
      times(unit_from_surface, on_surface) + dvec3(instances[instance].unit_from_surface[9],
                                                   instances[instance].unit_from_surface[10],
                                                   instances[instance].unit_from_surface[11]);
  dvec3 own_normal = times(normal_matrix(unit_from_surface), crossed(e1, e2));
  dvec3 normal = facing_normal(own_normal, direction);
  dvec3 point = on_ray(origin, direction, from_barycentrics, normal);
  precise dvec3 world = point * surface_view.inverse_scale + dvec3(view.centre[0], view.centre[1], view.centre[2]);
  dvec3 largest_vertex = max(max(abs(v0), abs(v1)), abs(v2));
  double offset = lift(point, normal, world, unit_from_surface, largest_vertex);
  precise double depth =
      product(dvec3(surface_view.depth[0], surface_view.depth[1], surface_view.depth[2]), world) + surface_view.depth[3];
  precise double view_z = depth * surface_view.depth_scale;
  float z = float(view_z);
  vec3 object_normal;
  bool has_normal = interpolated_normal(c, normals, corners, vec2(h.u, h.v), object_normal);

  write(kViewZPlane, pixel, z > 0.0 ? z : uintBitsToFloat(1u));
  write(kNormalPlane, pixel, shading_normal(instance, has_normal, object_normal, normal));
  write(kPositionPlane, pixel, vec3(world));
  write(kGeometricPlane, pixel, vec3(normal));
  write(kOffsetPlane, pixel, float(offset));
  write_instance(pixel, instance);
  write_motion(pixel, surface_view.moved != 0u ? motion_of(p, world) : vec3(0.0));
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= span.count) return;
  uvec2 p;
  if (!pixel_of_thread(i + span.first, view.width, view.height, p)) return;
  uint pixel = p.y * view.width + p.x;
  HitRecord h = hits[pixel];
  if (h.placement == 0xffffffffu)
    write_miss(pixel);
  else
    write_hit(p, pixel, h);
}
