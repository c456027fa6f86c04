#pragma once

#include <functional>
#include <memory>
#include <mutex>

#include "runtime/gpu/device_rays.h"
#include "runtime/gpu/gpu_config.h"
#include "runtime/trace/gpu/gpu_tables.h"
#include "runtime/trace/gpu/structure_cache.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/ray_tracer.h"
#include "runtime/trace/view_tracer.h"

namespace packtrace {

/// Traces the packed clusters of a baked file on a GPU; its hits are PackedTracer's, bit for bit (docs/gpu.md). With
/// GpuStructures::kDriver the driver traces decoded triangles instead, and its rounding decides which triangle a ray
/// hits. The packed tracer beside it chooses the trees, places instances and resolves hits.
class GpuTracer final : public RayTracer, public ViewTracer {
public:
  /// Keeps references, as PackedTracer does. Throws as PackedTracer and gpu::GpuScene do, and Error(kUnsupported) for
  /// geometry that deforms.
  /// @param cache with GpuStructures::kDriver: structures that tracers of the file share; null: separate ones
  GpuTracer(const BakedFile& file, const SceneSource& source, const GpuConfig& config, const Movers& movers = {},
            std::shared_ptr<StructureCache> cache = nullptr);
  /// Does the same at the detail of a plan, whose trees are made on the CPU.
  GpuTracer(const BakedFile& file, const LodSource& source, const GpuConfig& config, const Movers& movers = {},
            std::shared_ptr<StructureCache> cache = nullptr);

  std::string_view name() const override { return cache_ ? "gpu-rt" : "gpu"; }
  std::string_view isa() const override { return device_; }
  const UnitSpace& space() const override { return packed_.space(); }
  uint32_t preferred_rays_per_call() const override { return 1u << 16; }
  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override;
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override;
  void trace_view(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits,
                  const Progress& progress) const override;
  std::shared_ptr<gpu::DeviceView> trace_camera(const PrimaryCamera& camera, uint32_t ray_class,
                                                std::shared_ptr<gpu::DeviceView> reused,
                                                const Progress& progress) const override;
  std::span<const RayHit> hits(const gpu::DeviceView& picture) const override;
  SurfacePlanes read_surfaces(const gpu::DeviceView& picture) const override;
  std::optional<SurfacePlanes> make_surfaces(gpu::DeviceView& picture, const PrimaryCamera& now,
                                             const PrimaryCamera& previous, double no_motion_px,
                                             bool only_instances) const override;
  PointPlanes read_points(const gpu::DeviceView& picture, bool with_normals) const override;
  void trace_occlusion(const OcclusionPoints& points, const OcclusionSamples& samples, std::span<OcclusionSums> sums,
                       Progress& progress) const override;
  std::shared_ptr<gpu::DeviceAo> leave_occlusion(const OcclusionPoints& points, const OcclusionSamples& samples,
                                                 const OcclusionPicture& picture, std::shared_ptr<gpu::DeviceAo> reused,
                                                 Progress& progress) const override;
  void read_occlusion(const gpu::DeviceAo& picture, std::span<float> ao, std::span<float> hit_distance) const override;
  HitSurface resolve(const RayHit& hit) const override { return packed_.resolve(hit); }
  void place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) override;
  std::span<const Affine> world_from_object() const override { return packed_.world_from_object(); }
  std::array<DVec3, 3> object_vertices(const RayHit& hit, const HitSurface& surface) const override {
    return packed_.object_vertices(hit, surface);
  }
  std::vector<ResidentPart> resident() const override;
  std::span<const uint32_t> flat_instances() const override { return packed_.flat_instances(); }
  std::vector<TreeBytes> tree_bytes() const override;

  const gpu::GpuScene& scene() const { return *scene_; }
  const PackedTracer& packed() const { return packed_; }

private:
  void upload(const GpuConfig& config, std::shared_ptr<StructureCache> cache);
  void place_structures() const;
  void begin_picture() const;
  void follow_structures() const;
  std::unique_lock<std::mutex> lock_structures() const;
  /// Takes the results of points [first, first + count) from the device.
  using TakeSums = std::function<void(size_t first, size_t count)>;
  void trace_parts(const OcclusionPoints& points, const OcclusionSamples& samples, const TakeSums& take,
                   Progress& progress) const;
  void trace_part(const OcclusionPoints& points, size_t first, size_t count, const OcclusionSamples& samples,
                  const std::function<void(double)>& report) const;
  bool trace_picture(const OcclusionPoints& points, const OcclusionSamples& samples, Progress& progress) const;
  void trace_points(const OcclusionSamples& samples, const std::function<void(double)>& report) const;

  const BakedFile& file_;
  const SceneSource& source_;
  PackedTracer packed_;
  GpuTables tables_;
  std::unique_ptr<gpu::GpuScene> scene_;
  std::shared_ptr<StructureCache> cache_;      ///< null unless the driver traces
  TakenStructures structures_;                 ///< of the cache
  mutable uint64_t structures_generation_ = 0; ///< of the cache, when the structures were placed
  std::unique_ptr<gpu::DeviceRays> device_rays_;
  mutable bool surfaces_uploaded_ = false; ///< whether the tables of DeviceRays::set_surfaces() are up to date
  mutable std::mutex device_rays_mutex_;
  std::string device_; ///< its name, and how it makes floats
};

} // namespace packtrace
