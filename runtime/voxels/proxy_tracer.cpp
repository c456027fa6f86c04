#include "runtime/voxels/proxy_tracer.h"

#include <algorithm>
#include <cmath>

#include "compress/format/voxels/proxy_section.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

Bounds placed_box_of(const BakedFile& file, const PlacedGeometry& instance) {
  return transform_bounds(DAffine(instance.world_from_object), object_bounds(file.geometries()[instance.geometry]));
}

std::vector<uint8_t> geometries_with_proxies(const BakedFile& file) {
  std::vector<uint8_t> result(file.geometries().size());
  for (const Proxy& proxy : read_proxies(proxy_bytes(file))) result[proxy.record.geometry] = 1;
  return result;
}

} // namespace

std::vector<uint32_t> small_instances(const BakedFile& file, const SceneSource& source, const PrimaryCamera& view,
                                      double pixels) {
  if (proxy_bytes(file).empty())
    throw Error(ErrorKind::kUnsupported, "the file has no proxies for --proxy-beyond; bake it with --proxy voxels");
  const std::vector<uint8_t> has_proxy = geometries_with_proxies(file);
  const std::span<const PlacedGeometry> instances = source.instances();
  const bool perspective = view.projection() != Projection::kOrthographic;
  std::vector<uint32_t> result;
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const baked::GeometryRecord& geometry = file.geometries()[instances[i].geometry];
    if (has_proxy[instances[i].geometry] == 0 || (geometry.flags & baked::kWorldSpace) != 0) continue;
    if (flattens(DAffine(instances[i].world_from_object), object_bounds(geometry), source.world_bounds())) continue;
    const Bounds box = placed_box_of(file, instances[i]);
    const double diameter = box.diagonal();
    const double distance = std::max(glm::distance(box.centre(), view.eye()) - 0.5 * diameter, 0.0);
    const double pixel = view.pixel_spread() * (perspective ? distance : 1.0);
    if (diameter < pixels * pixel) result.push_back(i);
  }
  return result;
}

ProxyTracer::ProxyTracer(const RayTracer& whole, const BakedFile& file, const SceneSource& source,
                         std::vector<uint32_t> proxied, const TracerConfig& config)
    : proxied_(std::move(proxied)),
      voxels_(file, [this](uint32_t i) { return std::ranges::binary_search(proxied_, i); }),
      source_(source, proxied_,
              config.backend == Backend::kEmbree ? OtherInstances::Absent::kNoGeometry : OtherInstances::Absent::kFlat),
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
