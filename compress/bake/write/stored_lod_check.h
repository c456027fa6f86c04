#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "compress/bake/lod/lod_encoder.h"

namespace packtrace {

/// The geometry that LOD levels belong to, as written to the file.
struct LodBase {
  const baked::GeometryRecord& record; ///< ranges, counts and bounds are not used; they follow from `encoded`
  const EncodedGeometry& encoded;
  const std::vector<uint32_t>& slot_class; ///< material class per slot
  uint32_t max_levels = baked::kMaxLodLevels;
};

/// Returns which part of the levels a file reader would reject, or nothing. The levels may come from an untrusted file.
std::optional<std::string_view> find_stored_lod_fault(const EncodedLod& lod, const LodBase& base);

} // namespace packtrace
