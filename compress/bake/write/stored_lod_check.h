#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "compress/bake/lod/lod_encoder.h"

namespace packtrace {

/// The geometry that levels of detail belong to, as it goes into the file.
struct LodBase {
  const baked::GeometryRecord& record; ///< without ranges, counts and bounds: those follow from `encoded`
  const EncodedGeometry& encoded;
  const std::vector<uint32_t>& slot_class; ///< material class by slot
  uint32_t max_levels = baked::kMaxLodLevels;
};

/// What of the levels a reader of the file would refuse, or nothing. Relies on nothing: they may come from anywhere.
std::optional<std::string_view> find_stored_lod_fault(const EncodedLod& lod, const LodBase& base);

} // namespace packtrace
