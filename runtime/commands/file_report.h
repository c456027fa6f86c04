#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file_summary.h"

namespace packtrace {

/// What a baked file holds, as `info --json` and `bake --json` write it (docs/json_output.md).
nlohmann::json to_json(const FileSummary& summary);

/// The same for people: counts, errors, and a table of bytes by stream.
std::string to_text(const FileSummary& summary);

} // namespace packtrace
