#pragma once

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// `packtrace export FILE.ptk -o OUT --layout vertex16`: a baked file in a layout that engines upload as it is.
void add_export_command(CLI::App& app, GlobalOptions& globals);

} // namespace packtrace
