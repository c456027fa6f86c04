#include "runtime/commands/cli/option_list.h"

#include <CLI/CLI.hpp>

#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

ValueKind kind_of(const OptionEntry& entry) {
  if (entry.value_name.empty() && entry.choices.empty()) return ValueKind::kNoValue;
  if (!entry.choices.empty()) return ValueKind::kChoice;
  if (entry.value_name == "DIR") return ValueKind::kFolder;
  const bool file = entry.value_name == "FILE" || entry.value_name == "SCENE" || entry.value_name == "TEST" ||
                    entry.value_name == "REFERENCE";
  return file ? ValueKind::kFile : ValueKind::kText;
}

OptionEntry entry_of(const CLI::Option& option) {
  OptionEntry entry;
  for (const std::string& name : option.get_snames()) entry.short_names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) entry.long_names.push_back("--" + name);
  entry.choices = choices_of(option);
  entry.value_optional = has_optional_value(option);
  if (option.get_positional()) {
    entry.value_name = option.get_name(true);
  } else if (option.get_items_expected_max() > 0) {
    entry.value_name = entry.choices.empty() ? value_name(option) : "NAME";
  }
  entry.value = kind_of(entry);
  entry.repeatable = option.get_items_expected_max() > 1;
  entry.required = option.get_required();
  entry.description = option.get_description();
  entry.group = option.get_group();
  return entry;
}

VerbEntry entry_of(CLI::App& app) {
  VerbEntry entry{app.get_name(), app.get_description(), app.get_footer(), {}, {}};
  for (CLI::Option* option : app.get_options({}))
    (option->get_positional() ? entry.positionals : entry.options).push_back(entry_of(*option));
  return entry;
}

} // namespace

ProgramEntry list_options(CLI::App& app) {
  ProgramEntry entry{entry_of(app), {}};
  for (CLI::App* verb : app.get_subcommands([](CLI::App* known) { return !known->get_group().empty(); }))
    entry.verbs.push_back(entry_of(*verb));
  return entry;
}

} // namespace packtrace
