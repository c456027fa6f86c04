#pragma once

#include <string>

#include "runtime/commands/cli/option_list.h"

namespace packtrace {

/// Returns the program's manual page (section 1) as roff with man macros.
std::string man_page(const ProgramEntry& program, const std::string& version);

} // namespace packtrace
