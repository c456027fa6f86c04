#pragma once

#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "runtime/lod/lod_sharing.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

/// Returns the LOD hierarchies of a file's geometries, numbered as in the file, as input of LodSharing. A geometry
/// without levels has level 0 only; one without clusters gets a single cluster of no triangles. Throws Error(kInput) as
/// LodGeometry's constructor does.
std::vector<LodGeometry> lod_geometries(const BakedFile& file);

/// Returns a source's instances as input of LodSharing.
std::vector<LodInstance> lod_instances(const SceneSource& source);

/// A cluster of a BLAS.
struct BlasCluster {
  uint32_t geometry = 0; ///< geometry of the file: the BLAS's own, or one of its coarser levels
  uint32_t cluster = 0;  ///< number in that geometry
  uint32_t level = 0;
  uint32_t first_triangle = 0, first_vertex = 0; ///< numbers in the BLAS
  float error = 0.0f;                            ///< error of the group that it was simplified from; object units
};

/// A baked file at the detail of a plan. Its geometries are the plan's BLASes, and each instance refers to the BLAS
/// that the plan assigns to it. Triangles and vertices of a BLAS follow its clusters, level by level in the file's
/// order, so a BLAS of all of level 0 is numbered as in PackedSource. Keeps references: file and source must outlive
/// it; the plan need not.
///
/// position_error() is the quantisation error alone. Rays start on the traced surface, whatever its level, so their
/// offsets need not include its distance from level 0 (docs/lod_runtime.md).
class LodSource final : public SceneSource {
public:
  /// @param source a source of the same file
  /// @param sharing made from lod_geometries() and lod_instances() of the file
  /// @param plan a plan of `sharing`
  /// Throws Error(kLimitExceeded) if a BLAS has 2^32 or more triangles or vertices.
  LodSource(const BakedFile& file, const PackedSource& source, const LodSharing& sharing, const LodPlan& plan);

  uint32_t geometry_count() const override { return static_cast<uint32_t>(blas_.size()); }
  GeometryCounts counts(uint32_t blas) const override;
  void decode(uint32_t blas, std::span<Vec3> positions, std::span<Triangle> triangles) const override;
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override;
  std::optional<Vec3> shading_normal(uint32_t blas, uint32_t triangle, Vec2 barycentrics) const override;
  void look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const override;
  bool look_up_triangles(std::span<const SurfaceQuery> places, std::span<TriangleAttributes> out) const override;
  std::array<Vec2, 3> corner_uvs(uint32_t blas, uint32_t triangle) const override;
  float position_error(uint32_t blas) const override { return source_.position_error(blas_[blas].geometry); }
  SurfaceDetail detail_of(uint32_t instance, uint32_t triangle) const override;
  std::span<const PlacedGeometry> instances() const override { return instances_; }
  std::span<const Material> materials() const override { return source_.materials(); }
  AlphaMaskView mask(uint32_t index) const override { return source_.mask(index); }
  TextureView texture(uint32_t index) const override { return source_.texture(index); }
  bool has_shading() const override { return source_.has_shading(); }
  std::span<const Light> lights() const override { return source_.lights(); }
  std::span<const EnvironmentMap> environment_maps() const override { return source_.environment_maps(); }
  bool may_emit(uint32_t instance) const override { return source_.may_emit(instance); }
  std::span<const Camera> cameras() const override { return source_.cameras(); }
  /// Bounds of LOD level 0.
  Bounds world_bounds() const override { return source_.world_bounds(); }
  DVec3 origin() const override { return source_.origin(); }
  /// Bytes of the file and of the tables.
  uint64_t resident_bytes() const override;

  /// The file's geometry that a BLAS was made from.
  uint32_t base_geometry(uint32_t blas) const { return blas_[blas].geometry; }
  std::span<const BlasCluster> clusters(uint32_t blas) const {
    return std::span(clusters_).subspan(blas_[blas].first_cluster, blas_[blas].cluster_count);
  }
  /// Bounds, in object space, of all levels that the BLAS has clusters of.
  Bounds bounds(uint32_t blas) const;
  /// Returns the number in a BLAS of a cluster's triangle.
  /// @param cluster number in the file's cluster section; must be in the BLAS
  uint32_t triangle_number(uint32_t blas, uint32_t cluster, uint32_t triangle) const;

private:
  struct Blas {
    uint32_t geometry = 0;
    uint32_t triangles = 0, vertices = 0;
    size_t first_cluster = 0, cluster_count = 0; ///< range in clusters_
  };

  void add_blas(const LodGeometry& geometry, uint32_t number, std::span<const uint64_t> passed);
  const BlasCluster& find(uint32_t blas, uint32_t triangle) const;
  ClusterView view(const BlasCluster& cluster) const { return file_.cluster(cluster.geometry, cluster.cluster); }

  const BakedFile& file_;
  const PackedSource& source_;
  std::vector<Blas> blas_;
  std::vector<BlasCluster> clusters_;
  std::vector<PlacedGeometry> instances_;
  std::vector<double> stretch_; ///< by instance
};

} // namespace packtrace
