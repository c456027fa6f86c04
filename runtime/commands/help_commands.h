#pragma once

#include <string>

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds the verbs help, version, completion and man. They describe all verbs that `app` has when they are run.
void add_help_commands(CLI::App& app, GlobalOptions& globals, const std::string& version);

} // namespace packtrace
