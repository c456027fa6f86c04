#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace packtrace {

/// Returns report.html as text: one file without references to others. It holds the report as JSON, its pictures as
/// data: URIs, and a Content-Security-Policy that allows the page's own style and script, by their SHA-256, and nothing
/// else. If it would exceed `max_bytes`, first details of dominated points are left out, then pictures are reduced to a
/// half or a quarter, then the least important pictures are left out. The page lists what is missing.
///
/// Text of the report may hold any bytes: markup is escaped, and bytes that are not UTF-8 become U+FFFD.
/// @param report_json content of report.json (docs/measure.md); may lack any key
/// @param pictures folder that the paths of its pictures are relative to; those that cannot be read are left out
/// Throws Error(kLimitExceeded) if the text exceeds max_bytes even then.
std::string html_report(const nlohmann::json& report_json, const std::filesystem::path& pictures,
                        size_t max_bytes = 2'000'000);

/// Writes html_report() to `out`, replacing an earlier one.
/// @param report_json content of report.json (docs/measure.md)
/// @param pictures folder that the report's picture paths are relative to
/// Throws like html_report(), and Error(kIo) if writing fails.
void write_html_report(const nlohmann::json& report_json, const std::filesystem::path& pictures,
                       const std::filesystem::path& out);

} // namespace packtrace
