#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/file_summary.h"

namespace packtrace {

/// What the analysis of requirements decided, in sentences with counts and bytes: a line for each decision about a
/// stream, one on materials; then, if wanted, a line for each geometry.
std::string requirements_text(const FileSummary& summary, bool by_geometry);

/// The lines of requirements_text() on streams that were left out, which is what `bake` says unasked.
std::string dropped_streams_text(const FileSummary& summary);

/// The same for machines (docs/json_output.md): {"for", "keep", "streams", "materials"} and "geometries" if wanted.
nlohmann::json requirements_json(const FileSummary& summary, bool by_geometry);

/// The array "dropped_streams" of `bake --json`.
nlohmann::json dropped_streams_json(const FileSummary& summary);

} // namespace packtrace
