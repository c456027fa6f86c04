#pragma once

#include <memory>

#include "compress/format/file/baked_file.h"
#include "runtime/trace/movers.h"
#include "runtime/trace/packed/kernels/isa.h"
#include "runtime/trace/packed/scene/deformed_trees.h"
#include "runtime/trace/packed/scene/traced_trees.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

class PlacedTrees;

/// An array of rays or hits as kernels read it; the layouts are the same.
const packed::KernelRay* kernel_rays(std::span<const Ray> rays);
packed::KernelHit* kernel_hits(std::span<RayHit> hits);

/// Traces a baked file without unpacking it: triangles are decoded from the clusters' bits when rays reach them, and
/// the boxes are those of the file's trees, or of trees built here if the file has none. See docs/packed_bvh.md.
class PackedTracer final : public RayTracer {
public:
  /// Keeps references: both must outlive the tracer.
  /// @param source a source of the same file; provides instances and alpha masks
  /// Throws Error(kUnsupported) for an instruction set that this machine lacks, Error(kInput) for transforms that are
  /// not finite, Error(kUsage) for movers that do not exist or whose geometry shares the tree of the world space.
  PackedTracer(const BakedFile& file, const SceneSource& source, PackedIsa isa = chosen_isa(),
               const Movers& movers = {});
  /// Does the same at the detail of a plan: builds one tree per BLAS, except that all world-space geometries, which
  /// have one instance each, share one tree.
  PackedTracer(const BakedFile& file, const LodSource& source, PackedIsa isa = chosen_isa(), const Movers& movers = {});
  /// Traces geometries whose vertices move: each has a copy of its clusters and nodes, which deform() changes. They
  /// begin with the vertices of the file.
  /// @param deforming distinct geometries with clusters and with their own trees (none in the world's tree)
  /// Also throws Error(kInput) for other geometries, and as DeformedTree's constructor does.
  PackedTracer(const BakedFile& file, const SceneSource& source, std::span<const DeformingGeometry> deforming,
               const DeformConfig& config = {}, PackedIsa isa = chosen_isa(), const Movers& movers = {});
  /// Does the same at the detail of a plan. Shows the deforming geometries of another tracer, at level 0: after that
  /// tracer's deform(), call follow().
  /// @param leader tracer of the same file at LOD level 0; needed during this call only
  PackedTracer(const BakedFile& file, const LodSource& source, const PackedTracer& leader, PackedIsa isa = chosen_isa(),
               const Movers& movers = {});
  /// Traces other instances of the file of a tracer of LOD level 0. Shares that tracer's nodes and clusters, so only
  /// placements take memory.
  /// @param whole needed during this call only
  /// @param source must outlive the tracer
  /// Throws Error(kUsage) if `whole` has levels of detail or deforming geometries.
  PackedTracer(const PackedTracer& whole, const SceneSource& source);
  ~PackedTracer() override;
  PackedTracer(const PackedTracer&) = delete;
  PackedTracer& operator=(const PackedTracer&) = delete;

  std::string_view name() const override { return "packed"; }
  std::string_view isa() const override { return kernels_.isa; }
  const UnitSpace& space() const override;
  uint32_t preferred_rays_per_call() const override;

  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override;
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override;
  HitSurface resolve(const RayHit& hit) const override;
  void place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) override;
  std::span<const Affine> world_from_object() const override;
  std::array<DVec3, 3> object_vertices(const RayHit& hit, const HitSurface& surface) const override;
  std::vector<ResidentPart> resident() const override;
  std::vector<TreeBytes> tree_bytes() const override { return lod_trees_.trees; }

  std::span<const uint32_t> flat_instances() const override;

  /// Moves the vertices of a deforming geometry, in all its instances, to a new frame. space() stays: it holds the
  /// ranges of all deforming geometries. Not while other threads trace.
  /// @param geometry was given to the constructor
  /// Throws as DeformedTree::update() does.
  DeformStep deform(uint32_t geometry, const FrameVertices& frame);
  /// Like deform() for several geometries; the tree over placements is updated once.
  /// @param steps one element per frame
  void deform(std::span<const DeformedFrame> frames, std::span<DeformStep> steps);

  /// Places all instances again, at the source's transforms, after some refer to other geometries of their level chain
  /// (PackedSource::set_geometry()). space() holds all levels, so it stays. Not while other threads trace.
  void replace_instances(const Movers& movers = {});

  /// Object-space bounds of a geometry of the file in the current frame, if it deforms, else at rest.
  Bounds current_bounds(uint32_t geometry) const;

  /// Shows the current vertices of the deforming geometries that the leader given to the constructor has moved.
  void follow();

  /// The vertices of the triangle of a hit in the frame before, in the surface's coordinates; those of resolve() if its
  /// geometry does not deform or has had one frame only.
  void previous_vertices(const RayHit& hit, Vec3 (&vertices)[3]) const;
  /// Where a point of a deforming geometry was in the frame before, in object space; none for other geometries.
  /// @param triangle number in the instance's geometry
  /// @param barycentrics weights of its second and third vertex
  std::optional<DVec3> previous_position(uint32_t instance, uint32_t triangle, glm::dvec2 barycentrics) const;

  /// Build times and sizes of the trees; empty unless the source is a LodSource.
  const LodTrees& lod_trees() const { return lod_trees_; }

  /// From now on `search` finds the leaf nodes, and the trees' inner nodes are not read. See packed::TreeSearch.
  void set_tree_search(void (*search)(const void* searcher, const packed::TreeSearch&), const void* searcher);
  /// The trees, the file's or built here, by number.
  std::span<const baked::TreeRecord> tree_records() const;
  std::span<const packed::TraceTree> trees() const;

  /// The input of the kernels, for other tracers of the same trees. Valid until instances or geometry change.
  const packed::KernelScene& kernel_scene() const;
  const TracedTrees& traced_trees() const;
  const PlacedTrees& placed_trees() const;
  /// The first instance of a geometry of the file; a LOD level has that of its base geometry.
  uint32_t first_instance(uint32_t geometry) const;

  /// closest_hits() and any_hits() with statistics, which are added to `counters`. Slower.
  void count_closest(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits,
                     packed::KernelCounters& counters) const;
  void count_any(std::span<const Ray> rays, uint32_t ray_class, std::span<uint8_t> occluded,
                 packed::KernelCounters& counters) const;

private:
  struct Tables;

  struct Deformation;

  PackedTracer(const BakedFile& file, const SceneSource& source, const LodSource* lod, PackedIsa isa,
               const Movers& movers, const Deformation& deformation);
  void finish(const Movers& movers, bool keep_hulls);
  void find_deforming();
  void show_deforming(uint32_t geometry, uint32_t tree);
  uint32_t file_geometry(uint32_t geometry) const;
  void set_callbacks();
  void find_first_instances();
  void place_all(const Movers& movers);
  Bounds bounds_of(uint32_t geometry) const;
  uint32_t triangle_of(uint32_t cluster, uint32_t instance, uint32_t triangle) const;
  uint32_t instance_of(uint32_t placement, uint32_t cluster) const;
  uint32_t geometry_of_cluster(uint32_t cluster) const;

  const BakedFile& file_;
  const SceneSource& source_;
  const LodSource* const lod_; ///< source_ if it is a LodSource, else null
  const packed::Kernels& kernels_;
  LodTrees lod_trees_;
  std::unique_ptr<Tables> tables_;
};

} // namespace packtrace
