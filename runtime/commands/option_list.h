#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace packtrace {

/// What the value of an option, or a positional, is.
enum class ValueKind { kNoValue, kText, kChoice, kFile, kFolder };

/// An option or a positional as help, completion and the man page tell it.
struct OptionEntry {
  std::vector<std::string> short_names, long_names; ///< with their dashes; both empty for positionals
  std::string value_name;                           ///< "FILE"; empty for flags
  ValueKind value = ValueKind::kNoValue;
  std::vector<std::string> choices; ///< of kChoice
  bool value_optional = false;      ///< --lod beside --lod=all
  bool repeatable = false;          ///< may be given several times, and all of them count
  bool required = false;
  std::string description, group;
};

struct VerbEntry {
  std::string name, description, footer;
  std::vector<OptionEntry> options, positionals;
};

/// Everything that the command line knows, taken from the app that parses it.
struct ProgramEntry {
  VerbEntry program;            ///< what stands before the verb
  std::vector<VerbEntry> verbs; ///< without hidden ones
};

ProgramEntry list_options(CLI::App& app);

} // namespace packtrace
