#pragma once

#include <cmath>
#include <optional>
#include <random>

#include "runtime/trace/ray_offset.h"
#include "tests/runtime/trace/packed_scenes.h"

/// Rays that start on surfaces as ambient occlusion rays do.
namespace packtrace::test {

using Random = std::mt19937;

inline double uniform(Random& random, double lo, double hi) { return std::uniform_real_distribution(lo, hi)(random); }

inline DVec3 random_direction(Random& random) {
  for (;;) {
    const double x = uniform(random, -1, 1), y = uniform(random, -1, 1), z = uniform(random, -1, 1);
    const DVec3 v(x, y, z);
    if (const double squared = glm::dot(v, v); squared > 1e-4 && squared <= 1.0) return v / std::sqrt(squared);
  }
}

/// Adds a tetrahedron, two opposite edges of which are `length` apart. It is convex however its corners are rounded.
inline void add_needle(Mesh& mesh, DVec3 centre, DVec3 direction, double length, double thickness, Random& random) {
  const DVec3 side = glm::normalize(glm::cross(direction, random_direction(random)));
  const DVec3 other = glm::cross(direction, side);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const DVec3 corner :
       {direction * (-0.5 * length) + side * thickness, direction * (-0.5 * length) - side * thickness,
        direction * (0.5 * length) + other * thickness, direction * (0.5 * length) - other * thickness})
    mesh.positions.emplace_back(centre + corner);
  for (const Triangle t : {Triangle{0, 1, 2}, Triangle{0, 3, 1}, Triangle{0, 2, 3}, Triangle{1, 3, 2}})
    mesh.triangles.push_back(t + Triangle(first));
}

/// A point on a surface, as the renderer computes it.
struct Place {
  DVec3 position, normal; ///< world space
  double offset;
  uint32_t triangle; ///< in its geometry
};

inline std::optional<Place> place_on(const RayTracer& tracer, DVec3 target, DVec3 from) {
  const UnitSpace& space = tracer.space();
  Ray ray;
  ray.origin = Vec3(space.to_unit(from));
  ray.direction = Vec3(space.to_unit(target) - DVec3(ray.origin));
  const std::vector<RayHit> hits = closest(tracer, {&ray, 1});
  if (!hits[0].valid()) return std::nullopt;
  const HitSurface hit = tracer.resolve(hits[0]);
  const DVec3 v0(hit.vertices[0]), e = DVec3(hit.vertices[1]) - v0, f = DVec3(hit.vertices[2]) - v0;
  const DVec3 inside = v0 + e * double{hits[0].u} + f * double{hits[0].v};
  const Placement& placement = *hit.placement;
  const DVec3 cross = glm::cross(e, f);
  const DVec3 unit = placement.instanced ? transform_point(placement.unit_from_surface, inside) : inside;
  DVec3 normal = glm::normalize(placement.instanced ? placement.surface_normal * cross : cross);
  if (glm::dot(normal, DVec3(ray.direction)) > 0.0) normal = -normal;
  return Place{space.from_unit(unit), DVec3(Vec3(normal)), ray_offset(hit, space, unit, normal) * space.inverse_scale(),
               hit.triangle};
}

/// Returns a ray that starts as ambient occlusion rays do.
/// @param direction unit length
inline Ray start_at(const Place& place, DVec3 direction, double length, const UnitSpace& space) {
  Ray ray;
  ray.origin =
      Vec3(space.to_unit(DVec3(Vec3(place.position)) + place.normal * double{static_cast<float>(place.offset)}));
  ray.direction = Vec3(direction);
  ray.tfar = static_cast<float>(length * space.scale());
  return ray;
}

} // namespace packtrace::test
