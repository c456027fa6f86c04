#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace packtrace {

/// The number at a path of keys such as "bytes.file"; none if it is missing or null.
std::optional<double> number_at(const nlohmann::json& object, const std::string& path);

/// Whether a point takes part in fronts: it succeeded and traces level 0 with the reference's samples.
bool on_equal_terms(const nlohmann::json& point, uint32_t spp);

/// Adds "flags" to every point and returns "fronts".
nlohmann::json add_fronts(nlohmann::json& points, uint32_t spp);

/// "lod" of the report, from points with levels.
nlohmann::json lod_curve(const nlohmann::json& points);

/// "counts" of the report.
nlohmann::json counts_of(const nlohmann::json& points);

/// The content of report.csv.
std::string csv_of(const nlohmann::json& points);

} // namespace packtrace
