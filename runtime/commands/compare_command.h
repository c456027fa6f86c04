#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds `packtrace compare TEST REFERENCE`, which computes image metrics. Exit code 5 if a limit is exceeded.
void add_compare_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
