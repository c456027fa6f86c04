#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/file_summary.h"

namespace packtrace {

/// Levels of detail, as `info --json` and `bake --json` write them (docs/json_output.md); null where there are none.
/// @param by_geometry also those of each geometry
nlohmann::json lod_json(const FileSummary& summary, bool by_geometry);

/// The same for people: a table of levels; empty where there are none.
std::string lod_text(const FileSummary& summary, bool by_geometry);

} // namespace packtrace
