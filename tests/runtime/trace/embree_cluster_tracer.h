#pragma once

#include <memory>

#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

/// Contents of one user primitive of Embree.
enum class ClusterPrimitives : uint8_t {
  kClusters,  ///< a cluster: less memory
  kLeafNodes, ///< a node of up to eight leaves, of which a cluster has a few: faster
};

/// Traces a baked file's clusters with the same bits as PackedTracer, but finds them with Embree: each tree of the file
/// becomes an Embree scene of user primitives, one per cluster or leaf node. Embree's callbacks hand their rays to the
/// packed kernels. Rays are transformed into the tree's grid before Embree sees them, so no Embree instances are
/// needed. Checks the packed traversal against independent trees and box tests.
class EmbreeClusterTracer final : public RayTracer {
public:
  /// Keeps references: both must outlive the tracer.
  /// Throws as PackedTracer, Error(kUnsupported) for an Embree built without the needed features,
  /// Error(kLimitExceeded) where the system runs out of memory, Error(kCancelled) after Progress::cancel().
  EmbreeClusterTracer(const BakedFile& file, const SceneSource& source, PackedIsa isa = chosen_isa(),
                      ClusterPrimitives primitives = ClusterPrimitives::kClusters);
  ~EmbreeClusterTracer() override;
  EmbreeClusterTracer(const EmbreeClusterTracer&) = delete;
  EmbreeClusterTracer& operator=(const EmbreeClusterTracer&) = delete;

  std::string_view name() const override { return "embree-clusters"; }
  /// Instruction set of the kernels that decode and test triangles. Embree chooses its own for boxes.
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
  uint32_t preferred_rays_per_call() const override { return packed_.preferred_rays_per_call(); }
  HitSurface resolve(const RayHit& hit) const override { return packed_.resolve(hit); }

  /// The parts of PackedTracer, "bvh" (Embree's trees) and "cluster nodes" (the leaf nodes of each primitive).
  std::vector<ResidentPart> resident() const override;

  std::span<const uint32_t> flat_instances() const override { return packed_.flat_instances(); }

private:
  struct Trees;

  PackedTracer packed_;
  std::unique_ptr<Trees> trees_;
};

} // namespace packtrace
