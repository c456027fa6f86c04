#pragma once

#include <cstdint>
#include <optional>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Fault in LOD records, and its place.
struct LodFault {
  const char* section;
  uint64_t record;
  const char* what;
};

/// Checks level records. Also checks that exactly the geometries flagged as levels are named by level records above
/// level 0, once each, that they lie behind all others, and that they match their base. Does not rely on other checks.
std::optional<LodFault> find_lod_level_fault(const BakedSections& sections);

/// Checks groups and links: numbers in range, generating groups one level below, errors that do not shrink and spheres
/// that nest along each link, at least one cluster per group, and coarser clusters made from every group that is not
/// terminal. These checks guarantee that every chain of clusters from level 0 upwards is cut exactly once for any
/// threshold.
/// Relies on find_lod_level_fault(), cluster ranges and triangle counts.
std::optional<LodFault> find_lod_group_fault(const BakedSections& sections);

} // namespace packtrace
