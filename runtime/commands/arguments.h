#pragma once

#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace packtrace {

/// The words of a command line as CLI11 takes them. What is changed is what people write and CLI11 reads otherwise:
///  - a value may follow a short option after "=": -o=x.png;
///  - an option whose value may be left out takes the next word only where that can be one of its values, so that
///    `bake --lod scene.pbrt` keeps its scene;
///  - `--size 640 360` is `--size 640x360`;
///  - an option, or a verb, in the place of an option's value is an error: `--json --force` would write a file called
///  "--force".
///    `--json=--force` means just that.
/// Words behind "--" stay as they are.
/// @param words without the program's name
/// Throws Error(kUsage).
std::vector<std::string> plain_arguments(CLI::App& app, std::span<const char* const> words);

/// The value of an option in words that could not be parsed: of the last "--name VALUE" or "--name=VALUE" before "--";
/// empty where there is none.
std::string value_in_words(std::span<const char* const> words, const std::string& name);

} // namespace packtrace
