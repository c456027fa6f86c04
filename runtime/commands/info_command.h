#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds `packtrace info FILE...`, which prints the contents and memory use of baked files and pbrt scenes.
void add_info_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
