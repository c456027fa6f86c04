#pragma once

#include <locale>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/file_summary.h"

namespace packtrace {

/// What a baked file holds, as `info --json` and `bake --json` write it (docs/json_output.md).
/// @param by_geometry also what each geometry requires
nlohmann::json to_json(const FileSummary& summary, bool by_geometry);

/// For fmt's {:L}: 1234567 as 1,234,567, whatever the user's locale.
const std::locale& grouped();

/// One line: triangles, the file's bytes and those that are resident when it is traced, each also a triangle.
std::string size_text(const FileSummary& summary);

/// One line on the bytes on disk; empty for files with codec none.
std::string disk_text(const FileSummary& summary);

/// One line on the triangles that bake left out as their grid is too coarse for them; empty where there are none.
std::string collapsed_text(const FileSummary& summary);

/// The same as to_json() for people: counts, errors, and a table of bytes by stream.
std::string to_text(const FileSummary& summary, bool by_geometry);

} // namespace packtrace
