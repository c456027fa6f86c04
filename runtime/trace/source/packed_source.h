#pragma once

#include <array>
#include <vector>

#include "compress/format/shading/shading_codec.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

class BakedFile;
class ClusterView;

/// The decoded vertex normals of a triangle.
struct TriangleNormals {
  /// @param triangle number in the cluster, which has normals
  TriangleNormals(const ClusterView& cluster, uint32_t triangle);

  /// Returns the interpolated normal, unit length; none if the vertex normals cancel.
  /// @param barycentrics weights of the triangle's second and third vertex
  std::optional<Vec3> at(Vec2 barycentrics) const;

  std::array<Vec3, 3> corners;
};

/// Returns the interpolated vertex normal, unit length; none if the cluster has no normals or they cancel.
/// @param triangle, barycentrics as in TriangleNormals
std::optional<Vec3> interpolated_normal(const ClusterView& cluster, uint32_t triangle, Vec2 barycentrics);

/// Returns the texture coordinates of a triangle's vertices; (0,0) if the cluster has none.
/// @param triangle number in the cluster
std::array<Vec2, 3> corner_uvs(const ClusterView& cluster, uint32_t triangle);

/// A baked file as a SceneSource: everything but the tables below is read from the packed clusters on demand. Triangles
/// and vertices are numbered in the order of clusters; a vertex on a cluster border appears once per cluster, with the
/// same bits. Keeps a reference: the file must outlive it.
class PackedSource final : public SceneSource {
public:
  explicit PackedSource(const BakedFile& file);

  uint32_t geometry_count() const override;
  GeometryCounts counts(uint32_t geometry) const override;
  void decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const override;
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override;
  std::optional<Vec3> shading_normal(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const override;
  void look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const override;
  bool look_up_triangles(std::span<const SurfaceQuery> places, std::span<TriangleAttributes> out) const override;
  std::array<Vec2, 3> corner_uvs(uint32_t geometry, uint32_t triangle) const override;
  float position_error(uint32_t geometry) const override;
  SurfaceDetail detail_of(uint32_t instance, uint32_t triangle) const override;
  std::span<const PlacedGeometry> instances() const override { return instances_; }
  std::span<const Material> materials() const override { return materials_; }
  AlphaMaskView mask(uint32_t index) const override;
  TextureView texture(uint32_t index) const override;
  bool has_shading() const override;
  std::span<const Light> lights() const override { return shading_.lights; }
  std::span<const EnvironmentMap> environment_maps() const override { return shading_.maps; }
  bool may_emit(uint32_t instance) const override;
  std::span<const Camera> cameras() const override { return cameras_; }
  Bounds world_bounds() const override { return world_bounds_; }
  DVec3 origin() const override;

  /// Lets an instance refer to another geometry with the same material slots (baked::LevelChainRecord).
  void set_geometry(uint32_t instance, uint32_t geometry) { instances_[instance].geometry = geometry; }

  /// Bytes of the whole mapped file and of the tables.
  uint64_t resident_bytes() const override;

private:
  /// @param first out: the cluster's first triangle
  ClusterView find(uint32_t geometry, uint32_t triangle, uint32_t& first) const;

  const BakedFile& file_;
  std::vector<Material> materials_;
  ShadingData shading_;
  std::vector<Camera> cameras_;
  std::vector<PlacedGeometry> instances_;
  Bounds world_bounds_;
};

} // namespace packtrace
