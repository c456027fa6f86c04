#pragma once

#include <optional>
#include <span>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/file/baked_file.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

/// SceneSource::look_up() for sources over a baked file's clusters. A cluster is found and unpacked only if the
/// previous place lies in a different one.
/// @param find (geometry of the source, triangle in it, out: the cluster's first triangle) -> ClusterView
template <typename Find>
void look_up_in_clusters(const BakedFile& file, std::span<const PlacedGeometry> instances,
                         std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out, const Find& find) {
  std::optional<ClusterView> cluster;
  uint32_t geometry = 0, first = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    const SurfaceQuery& place = places[i];
    const uint32_t own = instances[place.instance].geometry;
    if (!cluster || own != geometry || place.triangle - first >= cluster->triangle_count())
      cluster.emplace(find(geometry = own, place.triangle, first));
    const std::optional<Vec3> normal = interpolated_normal(*cluster, place.triangle - first, place.barycentrics);
    out[i] = {file.instance_materials(place.instance)[cluster->material_slot()], normal.has_value(),
              normal.value_or(Vec3(0.0f))};
  }
}

} // namespace packtrace
