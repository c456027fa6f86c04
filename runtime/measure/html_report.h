#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

namespace packtrace {

/// Writes the report for people.
/// @param report_json content of report.json (docs/measure.md)
/// @param pictures folder that the report's picture paths are relative to
/// @param out the file, replaced if it exists
/// Throws Error(kIo).
void write_html_report(const nlohmann::json& report_json, const std::filesystem::path& pictures,
                       const std::filesystem::path& out);

} // namespace packtrace
