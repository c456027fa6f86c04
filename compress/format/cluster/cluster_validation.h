#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include "compress/format/layout/baked_format.h"

namespace packtrace {

/// What is wrong with the clusters of a geometry.
struct ClusterListFault {
  std::optional<uint32_t> cluster; ///< of the geometry; none: the geometry as a whole
  std::string_view what;
};

/// Checks the clusters of one geometry: each of them (find_cluster_fault()), their slots and the order of their
/// classes, the numbers of their first triangles and vertices, and the totals and bounds that the geometry states.
/// @param geometry whose lattice, encodings and range of the payload are checked
/// @param payload of the geometry; the 8 bytes behind it are readable
/// @param class_of_slot material_class() of slots below geometry.slot_count
/// @param each_checked find_cluster_fault() has found nothing in any of them before
std::optional<ClusterListFault> find_cluster_list_fault(const baked::GeometryRecord& geometry,
                                                        std::span<const baked::ClusterRecord> clusters,
                                                        const uint8_t* payload,
                                                        const std::function<uint32_t(uint32_t slot)>& class_of_slot,
                                                        bool each_checked = false);

} // namespace packtrace
