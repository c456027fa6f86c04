#pragma once

#include <nlohmann/json_fwd.hpp>

#include "runtime/commands/bake/bake_options.h"
#include "runtime/commands/cli/cli_support.h"

namespace packtrace {

/// Searches for options that keep the targets of a bake, sets them, and prints what it tried on standard error.
/// @return "target" of bake's JSON: {limits, camera, tried, chosen}
/// Throws Error(kUsage) for targets that cannot be parsed or measured, Error(kLimitExceeded) if no options keep them,
/// and like PointRunner.
nlohmann::json find_target(BakeOptions& options, const GlobalOptions& globals);

} // namespace packtrace
