#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace packtrace {

/// Accepts one of the given names, and suggests the most similar one otherwise. Help, completion and the man page get
/// the names from the validator through choices_of().
CLI::Validator one_of(std::vector<std::string> names);

/// Accepts a number in [lo, hi]. Unlike CLI::Range it rejects NaN.
CLI::Validator number_in(double lo, double hi);

/// The names that one_of() accepts for an option; empty if the option has no such check.
std::vector<std::string> choices_of(const CLI::Option& option);

/// Placeholder of an option's value, such as "FILE" or "N".
std::string value_name(const CLI::Option& option);

/// Whether an option's value is optional, as in `--lod` and `--lod all`.
bool has_optional_value(const CLI::Option& option);

/// Returns the verb with this name, including hidden verbs; null if there is none.
CLI::App* find_verb(CLI::App& app, const std::string& name);

/// Name of an option for messages: its long name ("--output"), else its short name ("-o"), else the name of the
/// positional.
std::string display_name(const CLI::Option& option);

/// Adds -o,--output to a verb that writes a single file. Giving the option twice is an error. `output` must outlive the
/// verb.
CLI::Option* add_output_option(CLI::App& verb, std::string& output, const std::string& description);

/// Extension of a file name in lower case: ".ptk" for "Room.PTK"; empty if there is none.
std::string ending_of(const std::filesystem::path& file);

/// Throws Error(kUsage) if the file's extension belongs to another format, such as ".glb" for a .ptk file. Unknown
/// extensions and names without one are accepted.
/// @param own accepted extensions in lower case
/// @param writer the verb or option that writes the file, for the message: "bake", "--json"
/// @param advice appended to the message; may be empty
void refuse_foreign_ending(const std::filesystem::path& file, std::initializer_list<std::string_view> own,
                           std::string_view writer, const std::string& advice);

/// Throws Error(kUsage) if there are names of given options: "A and B have no effect on WHAT".
void refuse_without_effect(const std::vector<std::string>& names, const std::string& what);

/// Quotes a word for a shell if necessary.
std::string shell_word(const std::string& word);

} // namespace packtrace
