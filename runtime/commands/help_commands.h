#pragma once

#include <string>

namespace CLI {
class App;
}

namespace packtrace {

struct GlobalOptions;

/// Adds the verbs about the program itself: help, version, completion, man. They tell of the verbs that `app` has when
/// they are run.
void add_help_commands(CLI::App& app, GlobalOptions& globals, const std::string& version);

} // namespace packtrace
