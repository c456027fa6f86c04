#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// `packtrace compare A B`: how different two images are; exit code 5 where a limit is exceeded.
void add_compare_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
