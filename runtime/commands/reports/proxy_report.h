#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "compress/format/file/file_summary.h"

namespace packtrace {

/// One line per proxy of a file, at most eight and a count of the others unless `all`; empty without proxies.
std::string proxies_text(const FileSummary& summary, bool all);

/// The line about proxies among the requirements, or nothing.
std::string proxies_requirement(const FileSummary& summary);

nlohmann::json proxies_json(const FileSummary& summary);

} // namespace packtrace
