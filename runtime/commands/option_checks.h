#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace packtrace {

/// Accepts the names given; of another value it says which one is most like it. Help, completion and the man page read
/// the names from the validator (choices_of()).
CLI::Validator one_of(std::vector<std::string> names);

/// A finite number in [lo, hi]; unlike CLI::Range it refuses NaN.
CLI::Validator number_in(double lo, double hi);

/// The values that one_of() lets an option have; empty where it takes others.
std::vector<std::string> choices_of(const CLI::Option& option);

/// What the value of an option is called: "FILE", "N".
std::string value_name(const CLI::Option& option);

/// Whether the value of an option may be left out: `--lod` beside `--lod all`.
bool has_optional_value(const CLI::Option& option);

/// The verb of that name, hidden ones too; null where there is none.
CLI::App* find_verb(CLI::App& app, const std::string& name);

/// The name to call an option by: "--output" where it has one, else "-o", else that of the positional.
std::string display_name(const CLI::Option& option);

/// Adds -o,--output for a verb that writes one file. It is an error to give it twice. `output` must outlive the verb.
CLI::Option* add_output_option(CLI::App& verb, std::string& output, const std::string& description);

/// Of the file's name, in lower case: ".ptk" for "Room.PTK"; empty where there is none.
std::string ending_of(const std::filesystem::path& file);

/// Throws Error(kUsage) where the file has an ending that says it is something else: ".glb" for a .ptk file. Endings
/// that mean nothing to this program, and none at all, are accepted.
/// @param own endings that are right, in lower case
/// @param writer what writes the file, for the message: "bake", "--json"
/// @param advice more for the message, or empty
void refuse_foreign_ending(const std::filesystem::path& file, std::initializer_list<std::string_view> own,
                           std::string_view writer, const std::string& advice);

/// A word as a shell takes it, in quotes where it has to be.
std::string shell_word(const std::string& word);

} // namespace packtrace
