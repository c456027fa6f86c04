#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds `packtrace export FILE.ptk -o OUT`, which converts a baked file to binary glTF 2.0, or to the vertex16 layout
/// that engines can upload without conversion.
void add_export_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
