#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds `packtrace render FILE -o OUT`, which renders denoised ambient occlusion of a baked file, or of a pbrt scene
/// with uncompressed float positions.
void add_render_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
