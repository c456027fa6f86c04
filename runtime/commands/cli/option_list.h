#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace packtrace {

/// The type of the value of an option or a positional.
enum class ValueKind { kNoValue, kText, kChoice, kFile, kFolder };

/// An option or a positional as listed in completion scripts and the man page.
struct OptionEntry {
  std::vector<std::string> short_names, long_names; ///< with their dashes; both empty for positionals
  std::string value_name;                           ///< "FILE"; empty for flags
  ValueKind value = ValueKind::kNoValue;
  std::vector<std::string> choices; ///< accepted values of kChoice
  bool value_optional = false;      ///< the value may be omitted, as in --lod and --lod=all
  bool repeatable = false;          ///< may be given several times, and all values count
  bool required = false;
  std::string description, group;
};

struct VerbEntry {
  std::string name, description, footer;
  std::vector<OptionEntry> options, positionals;
};

/// All verbs and options of the command line.
struct ProgramEntry {
  VerbEntry program;            ///< options of the program itself, which precede the verb
  std::vector<VerbEntry> verbs; ///< visible verbs
};

/// Lists the verbs and options of the app that parses the command line.
ProgramEntry list_options(CLI::App& app);

} // namespace packtrace
