#include "runtime/shade/hit_surfaces.h"

#include <cmath>

#include "runtime/trace/ray_offset.h"
#include "runtime/trace/surface_albedo.h"

namespace packtrace {
namespace {

/// Whether a side is the outer one.
bool is_outer(const Material& material, bool back_face) {
  return back_face == ((material.shading.bits & kOuterSideOpposite) != 0);
}

} // namespace

void HitSurfaces::look_up(std::span<const Ray> rays, std::span<const RayHit> hits, std::span<const float> widths,
                          std::vector<HitPoint>& points) const {
  std::vector<SurfaceQuery> places(hits.size());
  std::vector<SurfaceAttributes> attributes(hits.size());
  std::vector<HitSurface> surfaces(hits.size());
  for (size_t i = 0; i < hits.size(); ++i) {
    surfaces[i] = tracer_.resolve(hits[i]);
    places[i] = {surfaces[i].placement->instance, surfaces[i].triangle, Vec2(hits[i].u, hits[i].v)};
  }
  source_.look_up(places, attributes);
  points.resize(hits.size());
  const UnitSpace& space = tracer_.space();
  for (size_t i = 0; i < hits.size(); ++i) {
    const HitSurface& surface = surfaces[i];
    const Placement& placement = *surface.placement;
    const DVec3 a(surface.vertices[0]), u = DVec3(surface.vertices[1]) - a, v = DVec3(surface.vertices[2]) - a;
    DVec3 position = a + u * static_cast<double>(hits[i].u) + v * static_cast<double>(hits[i].v);
    DVec3 winding = glm::cross(u, v);
    if (placement.instanced) {
      position = transform_point(placement.unit_from_surface, position);
      winding = placement.surface_normal * winding;
    }
    const double length = glm::length(winding);
    const DVec3 direction(rays[i].direction);
    const DVec3 unit_winding = length > 0.0 ? winding / length : -glm::normalize(direction);
    const bool back = glm::dot(unit_winding, direction) > 0.0;
    const DVec3 facing = back ? -unit_winding : unit_winding;
    HitPoint& point = points[i];
    point.position = Vec3(space.from_unit(position));
    point.geometric = point.normal = Vec3(facing);
    if (attributes[i].has_normal) {
      const DVec3 normal = placement.object_normal * DVec3(attributes[i].normal);
      if (const double size = glm::length(normal); size > 0.0)
        point.normal = Vec3(normal * ((glm::dot(normal, facing) < 0.0 ? -1.0 : 1.0) / size));
    }
    point.material = attributes[i].material, point.instance = placement.instance;
    const float width = widths.empty() ? 0.0f : unit_length(widths[i]);
    point.albedo = surface_albedo(source_, &textures_, surface, point.material, places[i].barycentrics,
                                  {Vec3(glm::normalize(direction)), point.geometric, width});
    point.offset = static_cast<float>(ray_offset(surface, space, position, facing) * space.inverse_scale());
    point.outer = is_outer(source_.materials()[point.material], back);
  }
}

HitPoint HitSurfaces::of_pixel(const GBuffer& g, size_t pixel) const {
  HitPoint point;
  point.position = g.position[pixel], point.geometric = g.geometric_normal[pixel], point.normal = g.normal[pixel];
  point.albedo = g.albedo[pixel], point.offset = g.offset[pixel], point.material = g.material[pixel];
  point.instance = g.instance[pixel];
  point.outer = is_outer(source_.materials()[point.material], g.back_face[pixel] != 0);
  return point;
}

} // namespace packtrace
