#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// `packtrace bake SCENE -o OUT.ptk`: imports a pbrt scene and packs it.
void add_bake_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
