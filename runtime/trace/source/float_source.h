#pragma once

#include <vector>

#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// An unpacked Scene as a SceneSource. Its geometries are each shape outside objects, transformed to world space unless
/// it moves (Scene::motion), then each object with its shapes transformed to object space. Keeps a reference: the scene
/// must outlive it. Transforms are applied in double and rounded to float once. Triangles whose transform mirrors, or
/// whose shape reverses its orientation, are listed with their last two vertices swapped, so cross(p1 - p0, p2 - p0) of
/// decoded positions is the geometric normal that pbrt defines.
class FloatSource final : public SceneSource {
public:
  /// Throws Error(kLimitExceeded) if an object has 2^32 or more vertices or triangles, Error(kInput) for references
  /// out of range.
  explicit FloatSource(const Scene& scene);

  uint32_t geometry_count() const override { return static_cast<uint32_t>(geometries_.size()); }
  GeometryCounts counts(uint32_t geometry) const override { return geometries_[geometry].counts; }
  void decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const override;
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override;
  std::optional<Vec3> shading_normal(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const override;
  std::array<Vec2, 3> corner_uvs(uint32_t geometry, uint32_t triangle) const override;
  float position_error(uint32_t) const override { return 0.0f; }
  std::span<const PlacedGeometry> instances() const override { return instances_; }
  std::span<const Material> materials() const override { return scene_.materials; }
  AlphaMaskView mask(uint32_t index) const override { return view(scene_.masks[index]); }
  TextureView texture(uint32_t index) const override { return view(scene_.textures[index]); }
  bool has_shading() const override { return scene_.has_shading; }
  std::span<const Light> lights() const override { return scene_.lights; }
  std::span<const EnvironmentMap> environment_maps() const override { return scene_.environment_maps; }
  bool may_emit(uint32_t instance) const override;
  std::span<const Camera> cameras() const override { return scene_.cameras; }
  Bounds world_bounds() const override { return world_bounds_; }
  DVec3 origin() const override { return scene_.origin; }
  uint64_t resident_bytes() const override;

private:
  /// A mesh as a part of a geometry.
  struct Part {
    const Mesh* mesh = nullptr;
    DAffine geometry_from_mesh{1.0};
    glm::dmat3 normal_from_mesh{1.0};
    uint32_t material = 0;
    uint32_t first_triangle = 0; ///< in the geometry
    uint32_t first_vertex = 0;   ///< in the geometry
    bool swapped = false;        ///< whether the last two vertices of each triangle are swapped

    /// Returns a triangle's vertex numbers in the mesh.
    Triangle triangle(uint32_t triangle_in_mesh) const;
  };
  struct Geometry {
    uint32_t first_part = 0;
    uint32_t part_count = 0;
    GeometryCounts counts;
  };

  void add_geometry(std::span<const Shape> shapes);
  const Part& part_of(uint32_t geometry, uint32_t triangle) const;

  const Scene& scene_;
  std::vector<Part> parts_;
  std::vector<Geometry> geometries_;
  std::vector<PlacedGeometry> instances_;
  Bounds world_bounds_;
};

} // namespace packtrace
