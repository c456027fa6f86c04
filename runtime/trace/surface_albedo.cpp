#include "runtime/trace/surface_albedo.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

/// Sides of the footprint in texture coordinates.
struct UvSides {
  Vec2 a{0.0f}, b{0.0f};
};

/// The square across the cone is projected to the surface along the ray: one side stays, and the other becomes longer.
UvSides uv_sides(const HitSurface& surface, const std::array<Vec2, 3>& uv, const RayFootprint& footprint) {
  const DVec3 n(footprint.normal), d(footprint.direction);
  DVec3 edge_u = DVec3(surface.vertices[1]) - DVec3(surface.vertices[0]);
  DVec3 edge_v = DVec3(surface.vertices[2]) - DVec3(surface.vertices[0]);
  if (surface.placement->instanced) {
    edge_u = transform_vector(surface.placement->unit_from_surface, edge_u);
    edge_v = transform_vector(surface.placement->unit_from_surface, edge_v);
  }
  const DVec3 area = glm::cross(edge_u, edge_v);
  const double squared = glm::dot(area, area);
  if (!(squared > 0.0)) return {};
  const double cosine = std::abs(glm::dot(n, d));
  DVec3 across = glm::cross(n, d);
  if (!(glm::dot(across, across) > 1e-12)) across = edge_u; // head-on: all directions are alike
  across = glm::normalize(across);
  constexpr double kGrazing = 1e-3;
  const double width = static_cast<double>(footprint.width);
  const DVec3 along = glm::cross(n, across) * (width / std::max(cosine, kGrazing));
  const glm::dvec2 uv_u(uv[1] - uv[0]), uv_v(uv[2] - uv[0]);
  const auto in_uv = [&](DVec3 side) {
    const double u = glm::dot(glm::cross(side, edge_v), area) / squared;
    const double v = glm::dot(glm::cross(edge_u, side), area) / squared;
    return Vec2(uv_u * u + uv_v * v);
  };
  return {in_uv(across * width), in_uv(along)};
}

} // namespace

Vec3 surface_albedo(const SceneSource& source, const TexturePyramids* pyramids, const HitSurface& surface,
                    uint32_t material, Vec2 barycentrics, const RayFootprint& footprint) {
  const Material& of_hit = source.materials()[material];
  if (of_hit.albedo_texture == kNoTexture) return of_hit.albedo;
  const std::array<Vec2, 3> corners = source.corner_uvs(surface.geometry, surface.triangle);
  const Vec2 uv = interpolated_uv(corners, barycentrics);
  if (pyramids == nullptr || !(footprint.width > 0.0f)) return source.texture(of_hit.albedo_texture).sample(uv);
  const UvSides sides = uv_sides(surface, corners, footprint);
  return pyramids->mean(of_hit.albedo_texture, uv, sides.a, sides.b);
}

} // namespace packtrace
