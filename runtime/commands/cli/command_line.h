#pragma once

#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace packtrace {

/// Rewrites command-line words that CLI11 would misread:
///  - A short option accepts its value after "=": -o=x.png.
///  - An option with an optional value takes the next word only if it can be such a value, so `bake --lod scene.pbrt`
///    still has its scene.
///  - `--size 640 360` becomes `--size 640x360`.
///  - An option name or a verb in place of an option's value is an error. Otherwise `--json --force` would write a file
///    called "--force". `--json=--force` writes that file.
/// Words after "--" are not changed.
/// @param words the command line without the program's name
/// Throws Error(kUsage).
std::vector<std::string> normalised_arguments(CLI::App& app, std::span<const char* const> words);

/// Finds an option's value in a command line that could not be parsed: that of the last "--name VALUE" or
/// "--name=VALUE" before "--". Returns an empty string if there is none.
std::string value_in_words(std::span<const char* const> words, const std::string& name);

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
