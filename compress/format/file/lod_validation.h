#pragma once

#include <cstdint>
#include <optional>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// What is wrong with levels of detail, and where.
struct LodFault {
  const char* section;
  uint64_t record;
  const char* what;
};

/// Checks level records, and that geometries flagged as levels are those that level records name, once each, behind all
/// others and alike their base. Relies on nothing that is not checked here.
std::optional<LodFault> find_lod_level_fault(const BakedSections& sections);

/// Checks groups and links: numbers in range, generating groups one level below, errors that do not shrink and spheres
/// that hold those below along each link, members of each group, and coarser clusters made from it unless it is
/// terminal. With that each chain from a cluster of level 0 upwards is cut once for any threshold.
/// Relies on find_lod_level_fault(), cluster ranges and triangle counts.
std::optional<LodFault> find_lod_group_fault(const BakedSections& sections);

} // namespace packtrace
