#pragma once

#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"
#include "runtime/trace/source/texture_pyramids.h"

namespace packtrace {

/// A surface that a ray hit, from the side of the ray.
struct HitPoint {
  Vec3 position{0.0f};  ///< world space
  Vec3 geometric{0.0f}; ///< normal that faces the ray, unit length
  Vec3 normal{0.0f};    ///< shading normal in the same hemisphere
  Vec3 albedo{0.0f};
  float offset = 0.0f; ///< of rays that leave it, world units
  uint32_t material = 0, instance = 0;
  bool outer = true; ///< the ray comes from the outer side
};

/// Looks up the surfaces of hits.
class HitSurfaces {
public:
  HitSurfaces(const SceneSource& source, const RayTracer& tracer, const TexturePyramids& textures)
      : source_(source), tracer_(tracer), textures_(textures) {}

  /// @param rays, hits as many; all hits are valid
  /// @param widths of the rays' cones at the hits (RayFootprint), world units; empty: textures are looked up at points
  /// @param points receives as many elements
  void look_up(std::span<const Ray> rays, std::span<const RayHit> hits, std::span<const float> widths,
               std::vector<HitPoint>& points) const;

  /// The surface of a pixel that the camera hits.
  HitPoint of_pixel(const GBuffer& gbuffer, size_t pixel) const;

  const Material& material(const HitPoint& point) const { return source_.materials()[point.material]; }

  /// A ray that leaves a surface, on the side of its direction.
  /// @param direction unit length
  /// @param length in the tracer's space
  Ray leaving(const HitPoint& point, Vec3 direction, float length) const {
    const float side = glm::dot(direction, point.geometric) < 0.0f ? -point.offset : point.offset;
    const DVec3 origin = DVec3(point.position) + DVec3(point.geometric) * static_cast<double>(side);
    return {Vec3(tracer_.space().to_unit(origin)), 0.0f, direction, length};
  }
  /// Length in the tracer's space of a length in world units.
  float unit_length(float world) const {
    return static_cast<float>(static_cast<double>(world) * tracer_.space().scale());
  }
  float world_length(float unit) const {
    return static_cast<float>(static_cast<double>(unit) * tracer_.space().inverse_scale());
  }

private:
  const SceneSource& source_;
  const RayTracer& tracer_;
  const TexturePyramids& textures_;
};

} // namespace packtrace
