#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds `packtrace bake SCENE -o OUT.ptk`, which imports a pbrt scene and compresses it into a .ptk file.
void add_bake_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
