#pragma once

#include <span>
#include <string>

namespace CLI {
class App;
}

namespace packtrace {

/// Applies normalised_arguments() to the command line and parses it into the app's options. Error messages suggest the
/// closest known name instead of using CLI11's texts.
/// @param words the command line without the program's name
/// @return false if help or the version was requested, which has then been printed
/// Throws Error(kUsage).
bool parse_command_line(CLI::App& app, std::span<const char* const> words);

/// Returns the name of the first verb among the words, or an empty string.
std::string verb_in_words(CLI::App& app, std::span<const char* const> words);

/// Returns the names of all visible verbs in the order of --help, separated by ", ".
std::string verb_names(CLI::App& app);

} // namespace packtrace
