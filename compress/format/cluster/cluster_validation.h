#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include "compress/format/layout/baked_format.h"

namespace packtrace {

/// Fault in the clusters of a geometry.
struct ClusterListFault {
  std::optional<uint32_t> cluster; ///< number within the geometry; empty if the fault concerns the whole geometry
  std::string_view what;
};

/// Checks the clusters of one geometry: each cluster (find_cluster_fault()), the slots and the order of their classes,
/// the numbers of first triangles and vertices, and the totals and bounds in the geometry record.
/// @param geometry its lattice, encodings and payload range must have been checked
/// @param payload of the geometry, followed by 8 readable bytes
/// @param class_of_slot returns the material_class() of a slot below geometry.slot_count
/// @param each_checked find_cluster_fault() has already accepted every cluster
std::optional<ClusterListFault> find_cluster_list_fault(const baked::GeometryRecord& geometry,
                                                        std::span<const baked::ClusterRecord> clusters,
                                                        const uint8_t* payload,
                                                        const std::function<uint32_t(uint32_t slot)>& class_of_slot,
                                                        bool each_checked = false);

} // namespace packtrace
