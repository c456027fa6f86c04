#include "runtime/voxels/proxy_choice.h"

#include <algorithm>
#include <cmath>

#include "compress/format/voxels/proxy_codec.h"
#include "compress/format/voxels/proxy_section.h"
#include "pbrt_import/base/error.h"
#include "runtime/voxels/voxel_scene.h"

namespace packtrace {
namespace {

constexpr double kSavingPerDoubling = 0.06, kCostElsewhere = 0.1; // docs/voxels.md

double saving_of(uint64_t triangles, const VoxelIndex& size) {
  const double side = std::max({size[0], size[1], size[2]});
  return kSavingPerDoubling * std::log2(static_cast<double>(triangles) / (side * side));
}

} // namespace

ProxyChoice::ProxyChoice(const BakedFile& file) : file_(file), saving_(file.geometries().size()) {
  bool any = false;
  if (const std::span<const uint8_t> bytes = proxy_bytes(file); !bytes.empty())
    for (const Proxy& proxy : read_proxies(bytes)) {
      if (proxy.is_field()) continue; // slower than triangles
      const uint32_t g = proxy.record.geometry;
      saving_[g] = saving_of(file.geometries()[g].triangle_count, proxy.frame().size);
      any = true;
    }
  if (!any)
    throw Error(ErrorKind::kUnsupported, "the file has no voxels for --proxy-beyond; bake it with --proxy voxels");
}

std::vector<uint32_t> ProxyChoice::small_instances(const SceneSource& source, const PrimaryCamera& view,
                                                   double pixels) const {
  const std::span<const PlacedGeometry> instances = source.instances();
  const bool perspective = view.projection() != Projection::kOrthographic;
  std::vector<uint32_t> result;
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const baked::GeometryRecord& geometry = file_.geometries()[instances[i].geometry];
    if (!(saving_[instances[i].geometry] > 0.0) || (geometry.flags & baked::kWorldSpace) != 0) continue;
    const DAffine world_from_object(instances[i].world_from_object);
    const Bounds object = object_bounds(geometry);
    if (flattens(world_from_object, object, source.world_bounds())) continue;
    const Bounds box = transform_bounds(world_from_object, object);
    const double diameter = box.diagonal();
    const double distance = std::max(glm::distance(box.centre(), view.eye()) - 0.5 * diameter, 0.0);
    const double pixel = view.pixel_spread() * (perspective ? distance : 1.0);
    if (diameter < pixels * pixel) result.push_back(i);
  }
  return result;
}

bool ProxyChoice::pays(std::span<const uint32_t> chosen, const SceneSource& source, const GBuffer& seen) const {
  double saved = 0.0;
  for (const uint32_t instance : seen.instance) {
    if (instance == kNoInstance) continue;
    saved +=
        std::ranges::binary_search(chosen, instance) ? saving_[source.instances()[instance].geometry] : -kCostElsewhere;
  }
  return saved > 0.0;
}

} // namespace packtrace
