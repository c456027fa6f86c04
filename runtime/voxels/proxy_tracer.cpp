#include "runtime/voxels/proxy_tracer.h"

#include <algorithm>

namespace packtrace {
ProxyTracer::ProxyTracer(const RayTracer& whole, const BakedFile& file, const SceneSource& source,
                         std::vector<uint32_t> proxied, const TracerConfig& config)
    : proxied_(std::move(proxied)),
      voxels_(file, [this](uint32_t i) { return std::ranges::binary_search(proxied_, i); }),
      source_(source, proxied_,
              config.backend == Backend::kEmbree ? OtherInstances::Absent::kEmpty : OtherInstances::Absent::kFlat),
      others_(make_tracer_beside(whole, source_, &file, config)) {}

float ProxyTracer::voxel_distance(const Ray& ray) const {
  if (!(ray.tfar > ray.tnear)) return ray.tfar;
  const UnitSpace& unit = space();
  const DVec3 origin = unit.from_unit(DVec3(ray.origin)), direction = DVec3(ray.direction) * unit.inverse_scale();
  const double t = voxels_.first_distance(origin, direction, double{ray.tnear}, double{ray.tfar});
  return t < double{ray.tfar} ? static_cast<float>(t) : ray.tfar;
}

void ProxyTracer::closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                               std::span<RayHit> hits) const {
  others_->closest_hits(rays, ray_class, order, hits);
  for (size_t i = 0; i < rays.size(); ++i) {
    Ray rest = rays[i];
    if (hits[i].valid()) rest.tfar = std::min(rest.tfar, hits[i].t);
    if (const float t = voxel_distance(rest); t < rest.tfar) hits[i] = {t, 0.0f, 0.0f, 0, 0, 0};
  }
}

void ProxyTracer::any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                           std::span<uint8_t> occluded) const {
  others_->any_hits(rays, ray_class, order, occluded);
  for (size_t i = 0; i < rays.size(); ++i)
    if (occluded[i] == 0 && voxel_distance(rays[i]) < rays[i].tfar) occluded[i] = 1;
}

std::vector<ResidentPart> ProxyTracer::resident() const {
  std::vector<ResidentPart> parts = others_->resident();
  parts.push_back({"proxies", voxels_.resident_bytes() + source_.bytes()});
  return parts;
}

} // namespace packtrace
