#pragma once

#include <locale>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/file_summary.h"

namespace packtrace {

/// Contents of a baked file as JSON for `info --json` and `bake --json` (docs/json_output.md).
/// @param by_geometry also list the streams required by each geometry
nlohmann::json to_json(const FileSummary& summary, bool by_geometry);

/// The streams of a file with their names in reports, without those that are empty, and the total.
std::vector<std::pair<std::string, uint64_t>> stream_bytes(const StreamBytes& bytes);

/// Locale for fmt's {:L} that prints 1234567 as 1,234,567, independent of the user's locale.
const std::locale& grouped();

/// Lines about the geometries that deform; empty if none does.
std::string sequences_text(const FileSummary& summary);

/// One line with the number of triangles, the file size and the memory resident for tracing, in total and per triangle.
std::string size_text(const FileSummary& summary);

/// One line about the compressed size on disk; empty for files with codec none.
std::string disk_text(const FileSummary& summary);

/// What moves, over what time, and with what error; empty if nothing does.
std::string motion_text(const MotionSummary& motion);

/// One line about the triangles that bake dropped because the grid is too coarse for them; empty if there are none.
std::string collapsed_text(const FileSummary& summary);

/// Human-readable form of to_json(): counts, errors, and a table of bytes per stream.
std::string to_text(const FileSummary& summary, bool by_geometry);

} // namespace packtrace
