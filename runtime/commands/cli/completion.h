#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/commands/cli/option_list.h"

namespace packtrace {

/// Names of the shells that completion_script() supports.
const std::vector<std::string>& completion_shells();

/// Returns a script for bash, zsh or fish that completes verbs, options, option values and files.
/// Throws Error(kUsage) for other shells.
std::string completion_script(const ProgramEntry& program, std::string_view shell);

} // namespace packtrace
