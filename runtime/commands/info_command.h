#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// `packtrace info FILE`: what a baked file or a pbrt scene holds, and what each byte is for.
void add_info_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
