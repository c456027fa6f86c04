#include "runtime/trace/gpu/gpu_tracer.h"

#include <cassert>

namespace packtrace {

GpuTracer::GpuTracer(const BakedFile& file, const SceneSource& source, const GpuConfig& config, const Movers& movers)
    : packed_(file, source, chosen_isa(), movers), tables_(file, source, packed_) {
  upload(config);
}

GpuTracer::GpuTracer(const BakedFile& file, const LodSource& source, const GpuConfig& config, const Movers& movers)
    : packed_(file, source, chosen_isa(), movers), tables_(file, source, packed_) {
  upload(config);
}

void GpuTracer::upload(const GpuConfig& config) {
  scene_ = std::make_unique<gpu::GpuScene>(config, tables_.view());
  device_ = scene_->device_name() + (scene_->emulates_floats() ? ", exact floats" : "");
}

void GpuTracer::closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder, std::span<RayHit> hits) const {
  assert(hits.size() == rays.size());
  scene_->closest({kernel_rays(rays), rays.size()}, ray_class, {kernel_hits(hits), hits.size()});
}

void GpuTracer::any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder, std::span<uint8_t> occluded) const {
  assert(occluded.size() == rays.size());
  scene_->any({kernel_rays(rays), rays.size()}, ray_class, occluded);
}

void GpuTracer::place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) {
  packed_.place_instances(instances, world_from_object);
  tables_.update_placements();
  scene_->replace_placements(tables_.view());
}

std::vector<ResidentPart> GpuTracer::resident() const {
  std::vector<ResidentPart> parts = packed_.resident();
  parts.push_back({"on the GPU", scene_->bytes(), false});
  return parts;
}

} // namespace packtrace
