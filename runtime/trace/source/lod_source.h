#pragma once

#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "runtime/lod/lod_sharing.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

/// The levels of detail of a file's geometries, numbered as in the file: what LodSharing chooses from. Geometries
/// without levels have level 0 only; those without clusters stand for a single cluster of no triangles.
/// Throws Error(kInput) as LodGeometry's constructor.
std::vector<LodGeometry> lod_geometries(const BakedFile& file);

/// A source's instances, for LodSharing.
std::vector<LodInstance> lod_instances(const SceneSource& source);

/// A cluster of a BLAS.
struct BlasCluster {
  uint32_t geometry = 0; ///< of the file: the BLAS's geometry, or one of its levels
  uint32_t cluster = 0;  ///< of that geometry
  uint32_t level = 0;
  uint32_t first_triangle = 0, first_vertex = 0; ///< of the BLAS
  float error = 0.0f;                            ///< of the group it was made from; object units
};

/// A baked file at the detail of a plan: its geometries are the plan's BLASes, and instances are of the BLAS that they
/// use. Triangles and vertices of a BLAS follow its clusters, level by level in the file's order, so a BLAS of all of
/// level 0 is numbered as in PackedSource. Keeps references: file and source must outlive it; the plan need not.
///
/// position_error() is that of the lattice alone. Rays start where the traced surface is, of whatever detail, so their
/// offsets need not count how far that is from level 0 (docs/lod_runtime.md).
class LodSource final : public SceneSource {
public:
  /// @param source of the same file
  /// @param sharing of lod_geometries() and lod_instances() of it
  /// @param plan of `sharing`
  /// Throws Error(kLimitExceeded) where a BLAS has 2^32 triangles or vertices.
  LodSource(const BakedFile& file, const PackedSource& source, const LodSharing& sharing, const LodPlan& plan);

  uint32_t geometry_count() const override { return static_cast<uint32_t>(blas_.size()); }
  GeometryCounts counts(uint32_t blas) const override;
  void decode(uint32_t blas, std::span<Vec3> positions, std::span<Triangle> triangles) const override;
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override;
  std::optional<Vec3> shading_normal(uint32_t blas, uint32_t triangle, Vec2 barycentrics) const override;
  void look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const override;
  Vec2 uv(uint32_t blas, uint32_t triangle, Vec2 barycentrics) const override;
  float position_error(uint32_t blas) const override { return source_.position_error(blas_[blas].geometry); }
  SurfaceDetail detail_of(uint32_t instance, uint32_t triangle) const override;
  std::span<const PlacedGeometry> instances() const override { return instances_; }
  std::span<const Material> materials() const override { return source_.materials(); }
  AlphaMaskView mask(uint32_t index) const override { return source_.mask(index); }
  TextureView texture(uint32_t index) const override { return source_.texture(index); }
  std::span<const Camera> cameras() const override { return source_.cameras(); }
  /// Of level 0.
  Bounds world_bounds() const override { return source_.world_bounds(); }
  /// The file and the tables.
  uint64_t resident_bytes() const override;

  /// The file's geometry that a BLAS is of.
  uint32_t base_geometry(uint32_t blas) const { return blas_[blas].geometry; }
  std::span<const BlasCluster> clusters(uint32_t blas) const {
    return std::span(clusters_).subspan(blas_[blas].first_cluster, blas_[blas].cluster_count);
  }
  /// The box of all levels that the BLAS has clusters of; object space.
  Bounds bounds(uint32_t blas) const;
  /// A triangle's number in a BLAS. @param cluster in the file's cluster section; one of the BLAS's
  uint32_t triangle_number(uint32_t blas, uint32_t cluster, uint32_t triangle) const;

private:
  struct Blas {
    uint32_t geometry = 0;
    uint32_t triangles = 0, vertices = 0;
    size_t first_cluster = 0, cluster_count = 0; ///< of clusters_
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
