#pragma once

#include <string>

#include "runtime/commands/option_list.h"

namespace packtrace {

/// The program's page of section 1, in the man macros of roff.
std::string man_page(const ProgramEntry& program, const std::string& version);

} // namespace packtrace
