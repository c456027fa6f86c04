#pragma once

#include <string>

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds `packtrace bake SCENE -o OUT.ptk`, which imports a pbrt scene and compresses it into a .ptk file.
void add_bake_command(CLI::App& app, GlobalOptions& globals);

/// Adds `packtrace info FILE...`, which prints the contents and memory use of baked files and pbrt scenes.
void add_info_command(CLI::App& app, GlobalOptions& globals);

/// Adds `packtrace render FILE -o OUT`, which renders denoised ambient occlusion of a baked file, or of a pbrt scene
/// with uncompressed float positions.
void add_render_command(CLI::App& app, GlobalOptions& globals);

/// Adds `packtrace denoise FILE... -o OUT`, which denoises ambient occlusion in EXR pictures of any renderer.
void add_denoise_command(CLI::App& app, GlobalOptions& globals);

/// Adds `packtrace compare TEST REFERENCE`, which computes image metrics. Exit code 5 if a limit is exceeded.
void add_compare_command(CLI::App& app, GlobalOptions& globals);

/// Adds `packtrace export FILE.ptk -o OUT`, which converts a baked file to binary glTF 2.0, or to the vertex16 layout
/// that engines can upload without conversion.
void add_export_command(CLI::App& app, GlobalOptions& globals);

/// Adds `packtrace measure SCENE -o DIR`, which measures size, accuracy and speed over many options of bake.
/// @param version the program's, for the report
void add_measure_command(CLI::App& app, GlobalOptions& globals, const std::string& version);

/// Adds `packtrace view FILE...`, which shows baked files and pbrt scenes live, or by a script without a window.
void add_view_command(CLI::App& app, GlobalOptions& globals);

/// Adds the verbs help, version, completion and man. They describe all verbs that `app` has when they are run.
void add_help_commands(CLI::App& app, GlobalOptions& globals, const std::string& version);

} // namespace packtrace
