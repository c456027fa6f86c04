#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/trace/make_tracer.h"
#include "runtime/voxels/other_instances.h"
#include "runtime/voxels/voxel_scene.h"

namespace packtrace {

/// Traces some instances of a file as voxels, and the others as another tracer does. For occlusion rays: hits of voxels
/// have a distance, but no surface to resolve().
///
/// A ray that begins in the grid of an instance ignores that instance's voxels for the length of a voxel's diagonal, so
/// that surfaces do not occlude themselves; what is nearer is smaller than the proxy's error.
class ProxyTracer final : public RayTracer {
public:
  /// @param whole tracer of all instances of `source` at LOD level 0, whose trees are shared as make_tracer_beside()
  /// does; needed during this call only
  /// @param proxied instances, ascending; not empty
  /// @param source must outlive the tracer
  /// @param config of `whole`, without movers
  /// Throws like make_tracer().
  ProxyTracer(const RayTracer& whole, const BakedFile& file, const SceneSource& source, std::vector<uint32_t> proxied,
              const TracerConfig& config);

  std::string_view name() const override { return others_->name(); }
  std::string_view isa() const override { return others_->isa(); }
  const UnitSpace& space() const override { return others_->space(); }
  uint32_t preferred_rays_per_call() const override { return others_->preferred_rays_per_call(); }
  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override;
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override;
  /// @param hit not of a voxel
  HitSurface resolve(const RayHit& hit) const override { return others_->resolve(hit); }
  /// Those of the tracer of the others, and "proxies".
  std::vector<ResidentPart> resident() const override;
  std::vector<TreeBytes> tree_bytes() const override { return others_->tree_bytes(); }

  std::span<const uint32_t> proxied() const { return proxied_; }

private:
  /// Where a ray meets a voxel before its tfar; tfar if it does not.
  float voxel_distance(const Ray& ray) const;

  std::vector<uint32_t> proxied_;
  VoxelScene voxels_;
  OtherInstances source_;
  std::unique_ptr<RayTracer> others_;
};

} // namespace packtrace
