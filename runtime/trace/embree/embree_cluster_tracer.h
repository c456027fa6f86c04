#pragma once

#include <memory>
#include <optional>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

/// What a user primitive of Embree's is.
enum class ClusterPrimitives : uint8_t {
  kClusters,  ///< smaller
  kLeafNodes, ///< faster: a node of up to eight leaves, of which a cluster has a few
};

/// Traces a baked file's clusters as PackedTracer does, to the bit, but finds them with Embree: a tree of the file
/// becomes a scene of user primitives, one for each cluster or leaf node, and what Embree's callbacks get is handed to
/// the packed kernels. Rays are moved into the tree's grid before Embree sees them, so instances need no Embree
/// instances.
class EmbreeClusterTracer final : public RayTracer {
public:
  /// Keeps references: both must outlive the tracer.
  /// Throws as PackedTracer, Error(kUnsupported) for an Embree built without the needed features,
  /// MemoryError where the budget does not suffice for Embree's trees, Error(kLimitExceeded) where the system runs out
  /// of memory, Error(kCancelled) after Progress::cancel().
  EmbreeClusterTracer(const BakedFile& file, const SceneSource& source, PackedIsa isa = chosen_isa(),
                      ClusterPrimitives primitives = ClusterPrimitives::kClusters,
                      const std::optional<MemoryBudget>& memory = std::nullopt);
  ~EmbreeClusterTracer() override;
  EmbreeClusterTracer(const EmbreeClusterTracer&) = delete;
  EmbreeClusterTracer& operator=(const EmbreeClusterTracer&) = delete;

  std::string_view name() const override { return "embree-clusters"; }
  /// Of the kernels that decode and test triangles; Embree chooses its own for boxes.
  std::string_view isa() const override { return packed_.isa(); }
  const UnitSpace& space() const override { return packed_.space(); }

  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override {
    packed_.closest_hits(rays, ray_class, order, hits);
  }
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override {
    packed_.any_hits(rays, ray_class, order, occluded);
  }
  uint32_t rays_together() const override { return packed_.rays_together(); }
  HitSurface resolve(const RayHit& hit) const override { return packed_.resolve(hit); }

  /// PackedTracer's, "bvh": what Embree holds, and "cluster nodes": which nodes are a cluster's.
  std::vector<ResidentPart> resident() const override;

  std::span<const uint32_t> flat_instances() const override { return packed_.flat_instances(); }

private:
  struct Trees;

  PackedTracer packed_;
  std::unique_ptr<Trees> trees_;
};

} // namespace packtrace
