#pragma once

#include "runtime/commands/render/render_options.h"

namespace packtrace {

/// Runs `render --path`. Returns the exit code. Throws as the verb does.
int render_sequence(const RenderOptions& options, const GlobalOptions& globals);

} // namespace packtrace
