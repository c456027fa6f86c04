#include "compress/format/cluster/cluster_validation.h"

#include <cmath>

#include "compress/format/cluster/cluster_codec.h"

namespace packtrace {

std::optional<ClusterListFault> find_cluster_list_fault(const baked::GeometryRecord& geometry,
                                                        std::span<const baked::ClusterRecord> clusters,
                                                        const uint8_t* payload,
                                                        const std::function<uint32_t(uint32_t slot)>& class_of_slot,
                                                        bool each_checked) {
  uint64_t triangles = 0, vertices = 0, of_class = 0;
  uint32_t material_class = 0;
  for (uint32_t i = 0; i < clusters.size(); ++i) {
    const baked::ClusterRecord& c = clusters[i];
    const auto fault = [&](std::string_view what) { return ClusterListFault{i, what}; };
    if (c.material_slot >= geometry.slot_count) return fault("material slot");
    for (; material_class < 8 && of_class == geometry.class_clusters[material_class]; of_class = 0) ++material_class;
    const uint32_t of_cluster = class_of_slot(c.material_slot);
    if (of_cluster != material_class) return fault("material class order");
    ++of_class;
    if (c.first_triangle != triangles || c.first_vertex != vertices) return fault("first triangle or vertex");
    if (!each_checked)
      if (const auto what = find_cluster_fault(geometry, c, payload, geometry.payload_bytes)) return fault(*what);
    if ((of_cluster & baked::kMaskedClass) != 0 && (c.flags & baked::kClusterHasUvs) == 0)
      return fault("masked material without texture coordinates");
    triangles += c.triangle_count;
    vertices += c.vertex_count;
  }
  if (triangles != geometry.triangle_count || vertices != geometry.vertex_count)
    return ClusterListFault{std::nullopt, "totals"};
  uint64_t classes = 0;
  for (const uint32_t count : geometry.class_clusters) classes += count;
  if (classes != clusters.size()) return ClusterListFault{std::nullopt, "material class counts"};
  for (size_t axis = 0; axis < 3; ++axis)
    if (!clusters.empty() && !(std::isfinite(geometry.bounds_lo[axis]) && std::isfinite(geometry.bounds_hi[axis]) &&
                               geometry.bounds_lo[axis] <= geometry.bounds_hi[axis]))
      return ClusterListFault{std::nullopt, "bounds"};
  return std::nullopt;
}

} // namespace packtrace
