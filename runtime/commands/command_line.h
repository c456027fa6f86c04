#pragma once

#include <span>
#include <string>

namespace CLI {
class App;
}

namespace packtrace {

/// Parses the words behind the program's name into the app's options, after normalised_arguments(). What is wrong is said in
/// this program's words, with the nearest name there is.
/// @return false where the words asked for help or the version, which has been printed
/// Throws Error(kUsage).
bool parse_command_line(CLI::App& app, std::span<const char* const> words);

/// The verb among the words; empty where there is none.
std::string verb_in_words(CLI::App& app, std::span<const char* const> words);

/// Of verbs that are shown, in the order of --help.
std::string verb_names(CLI::App& app);

} // namespace packtrace
