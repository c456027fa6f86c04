#include "runtime/trace/source/scene_source.h"

namespace packtrace {

void SceneSource::look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const {
  for (size_t i = 0; i < places.size(); ++i) {
    const SurfaceQuery& place = places[i];
    const uint32_t geometry = instances()[place.instance].geometry;
    const std::optional<Vec3> normal = shading_normal(geometry, place.triangle, place.barycentrics);
    out[i] = {material_of(place.instance, place.triangle), normal.has_value(), normal.value_or(Vec3(0.0f))};
  }
}

} // namespace packtrace
