#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/file_summary.h"

namespace packtrace {

/// LOD levels as JSON for `info --json` and `bake --json` (docs/json_output.md); null if the file has none.
/// @param by_geometry also list the levels of each geometry
nlohmann::json lod_json(const FileSummary& summary, bool by_geometry);

/// Human-readable form of lod_json(): a table of levels; empty if the file has none.
std::string lod_text(const FileSummary& summary, bool by_geometry);

} // namespace packtrace
