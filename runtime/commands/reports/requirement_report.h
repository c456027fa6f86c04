#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/file_summary.h"

namespace packtrace {

/// Human-readable result of the requirement analysis, which decides what streams (normals, uv, tangents) are stored: a
/// line per decision with counts and bytes, and a line about materials.
/// @param by_geometry also add a line per geometry
std::string requirements_text(const FileSummary& summary, bool by_geometry);

/// The lines of requirements_text() about dropped streams, which `bake` always prints.
std::string dropped_streams_text(const FileSummary& summary);

/// JSON form of requirements_text() (docs/json_output.md): {"for", "keep", "streams", "materials"}, with by_geometry
/// also "geometries".
nlohmann::json requirements_json(const FileSummary& summary, bool by_geometry);

/// The array "dropped_streams" of `bake --json`.
nlohmann::json dropped_streams_json(const FileSummary& summary);

} // namespace packtrace
