#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "runtime/measure/ao_error.h"
#include "runtime/measure/measure_folder.h"

namespace packtrace {

/// A point whose pictures a report shows.
struct PicturedPoint {
  std::string id, title;
  AoImage ao;
};

/// Writes the pictures of points beside the float reference into DIR/pictures: whole pictures, and crops of the tiles
/// with the largest errors, enlarged without interpolation.
/// @param instances instance number per pixel of the reference
/// @param instance_names names of their geometries; may be empty
/// @return {"pictures", "tiles"} of the report. Throws Error(kIo).
nlohmann::json write_pictures(const std::vector<PicturedPoint>& points, const AoImage& reference,
                              const std::vector<uint32_t>& instances, const std::vector<std::string>& instance_names,
                              uint32_t tile_px, const MeasureFolder& folder);

} // namespace packtrace
