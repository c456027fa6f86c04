#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// `packtrace render FILE -o OUT`: denoised ambient occlusion of a baked file, or of a pbrt scene kept in floats.
void add_render_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
