#pragma once

#include <vector>

#include "runtime/trace/source/scene_source.h"

namespace packtrace {

class BakedFile;
class ClusterView;

/// Interpolated vertex normal of unit length; none where the cluster has none or they cancel.
/// @param triangle of the cluster @param barycentrics weights of its second and third vertex
std::optional<Vec3> interpolated_normal(const ClusterView& cluster, uint32_t triangle, Vec2 barycentrics);

/// Interpolated texture coordinates; (0,0) where the cluster has none.
Vec2 interpolated_uv(const ClusterView& cluster, uint32_t triangle, Vec2 barycentrics);

/// A baked file seen through SceneSource: everything but the tables below is read from the packed clusters when asked
/// for. Triangle numbers follow the clusters' order, and so do vertices; those on cluster borders appear once for each
/// cluster, with the same bits. Keeps a reference: the file must outlive it.
class PackedSource final : public SceneSource {
public:
  explicit PackedSource(const BakedFile& file);

  uint32_t geometry_count() const override;
  GeometryCounts counts(uint32_t geometry) const override;
  void decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const override;
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override;
  std::optional<Vec3> shading_normal(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const override;
  void look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const override;
  Vec2 uv(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const override;
  float position_error(uint32_t geometry) const override;
  std::span<const PlacedGeometry> instances() const override { return instances_; }
  std::span<const Material> materials() const override { return materials_; }
  AlphaMaskView mask(uint32_t index) const override;
  TextureView texture(uint32_t index) const override;
  std::span<const Camera> cameras() const override { return cameras_; }
  Bounds world_bounds() const override { return world_bounds_; }

  /// The whole file, as it is mapped, and the tables.
  uint64_t resident_bytes() const override;

private:
  const BakedFile& file_;
  std::vector<Material> materials_;
  std::vector<Camera> cameras_;
  std::vector<PlacedGeometry> instances_;
  Bounds world_bounds_;
};

} // namespace packtrace
