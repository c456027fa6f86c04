#pragma once

#include <optional>
#include <span>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/file/baked_file.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

/// SceneSource::look_up() for sources over a baked file's clusters. A cluster is found and unpacked only if the
/// previous place lies in a different one, and normals are decoded only if it lies on a different triangle.
/// @param find (geometry of the source, triangle in it, out: the cluster's first triangle) -> ClusterView
template <typename Find>
void look_up_in_clusters(const BakedFile& file, std::span<const PlacedGeometry> instances,
                         std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out, const Find& find) {
  std::optional<ClusterView> cluster;
  std::optional<TriangleNormals> normals; ///< of `triangle`; none if its cluster has none
  uint32_t geometry = 0, first = 0, triangle = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    const SurfaceQuery& place = places[i];
    const uint32_t own = instances[place.instance].geometry;
    const bool same_cluster = cluster && own == geometry && place.triangle - first < cluster->triangle_count();
    if (!same_cluster) cluster.emplace(find(geometry = own, place.triangle, first));
    if (!same_cluster || place.triangle != triangle) {
      normals.reset();
      if (cluster->has_normals()) normals.emplace(*cluster, place.triangle - first);
      triangle = place.triangle;
    }
    const std::optional<Vec3> normal = normals ? normals->at(place.barycentrics) : std::nullopt;
    out[i] = {file.instance_materials(place.instance)[cluster->material_slot()], normal.has_value(),
              normal.value_or(Vec3(0.0f))};
  }
}

/// SceneSource::look_up_triangles() for them. Neighbours in the same cluster find and unpack it once.
/// @param find as above
template <typename Find>
void look_up_triangles_in_clusters(const BakedFile& file, std::span<const PlacedGeometry> instances,
                                   std::span<const SurfaceQuery> places, std::span<TriangleAttributes> out,
                                   const Find& find) {
  std::optional<ClusterView> cluster;
  uint32_t geometry = 0, first = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    const SurfaceQuery& place = places[i];
    const uint32_t own = instances[place.instance].geometry;
    if (!cluster || own != geometry || place.triangle - first >= cluster->triangle_count())
      cluster.emplace(find(geometry = own, place.triangle, first));
    out[i].material = file.instance_materials(place.instance)[cluster->material_slot()];
    out[i].normals = {Vec3(0.0f), Vec3(0.0f), Vec3(0.0f)};
    if (cluster->has_normals()) out[i].normals = TriangleNormals(*cluster, place.triangle - first).corners;
  }
}

} // namespace packtrace
