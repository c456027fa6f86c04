#include "runtime/commands/cli/man_page.h"

#include <algorithm>
#include <set>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace packtrace {
namespace {

/// Escapes text for roff, including control characters at the start of a line.
std::string roff(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    const bool line_starts = escaped.empty() || escaped.back() == '\n';
    if (line_starts && (c == '.' || c == '\'')) escaped += "\\&";
    if (c == '\\')
      escaped += "\\e";
    else if (c == '-')
      escaped += "\\-";
    else
      escaped += c;
  }
  return escaped;
}

/// Escapes a paragraph, with line ends replaced by spaces.
std::string flowing(const std::string& text) {
  std::string joined = text;
  std::ranges::replace(joined, '\n', ' ');
  return roff(joined);
}

/// Formats "-o, --output FILE" with the names in bold and the value in italics.
std::string heading_of(const OptionEntry& option) {
  std::string heading;
  for (const auto& names : {option.short_names, option.long_names})
    for (const std::string& name : names) heading += (heading.empty() ? "" : ", ") + ("\\fB" + roff(name) + "\\fR");
  if (option.value_name.empty()) return heading;
  std::string value = option.choices.empty() ? "\\fI" + roff(option.value_name) + "\\fR"
                                             : roff(fmt::format("{}", fmt::join(option.choices, "|")));
  if (heading.empty()) return value;
  return heading + (option.value_optional ? " [" + value + "]" : " " + value);
}

std::string options_of(const std::vector<OptionEntry>& options, const std::string& group) {
  std::string text;
  for (const OptionEntry& option : options)
    if (option.group == group) text += ".TP\n" + heading_of(option) + "\n" + flowing(option.description) + "\n";
  return text;
}

/// Formats the option groups of a verb, except those in `told`, which are listed once for all verbs.
std::string groups_of(const VerbEntry& verb, const std::set<std::string>& told) {
  std::vector<std::string> groups;
  for (const OptionEntry& option : verb.options)
    if (std::ranges::find(groups, option.group) == groups.end() && !told.contains(option.group))
      groups.push_back(option.group);
  std::string text;
  for (const std::string& group : groups) {
    if (group != "Options") text += ".PP\n" + roff(group) + ":\n";
    text += options_of(verb.options, group);
  }
  return text;
}

/// Formats the end of a help text. Indented lines are examples and keep their line ends; other lines are filled.
std::string footer_of(const std::string& footer) {
  std::string text;
  bool example = false;
  for (const std::string& line : CLI::detail::split(footer, '\n')) {
    const bool indented = line.starts_with("  ");
    if (indented != example) text += indented ? ".RS\n.nf\n" : ".fi\n.RE\n";
    example = indented;
    if (!line.empty()) text += roff(CLI::detail::trim_copy(line)) + "\n";
  }
  return text + (example ? ".fi\n.RE\n" : "");
}

std::string usage_of(const VerbEntry& verb) {
  std::string usage = "\\fBpacktrace " + roff(verb.name) + "\\fR";
  if (verb.options.size() > 1) usage += " [\\fIOPTIONS\\fR]"; // more than --help
  for (const OptionEntry& positional : verb.positionals) {
    const std::string name = "\\fI" + roff(positional.value_name) + "\\fR" + (positional.repeatable ? " ..." : "");
    usage += positional.required ? " " + name : " [" + name + "]";
  }
  return usage;
}

} // namespace

std::string man_page(const ProgramEntry& program, const std::string& version) {
  std::string page = fmt::format(".TH PACKTRACE 1 \"\" \"packtrace {}\" \"User Commands\"\n", roff(version));
  const std::string& title = program.program.description; // "packtrace: what it is"
  page += ".SH NAME\npacktrace \\- " + roff(title.substr(title.find(": ") + 2)) + "\n.SH SYNOPSIS\n";
  for (const VerbEntry& verb : program.verbs)
    page += (&verb == &program.verbs.front() ? "" : ".br\n") + usage_of(verb) + "\n";
  page += ".SH DESCRIPTION\n" + footer_of(program.program.footer);
  page +=
      ".SH OPTIONS\nThese options may precede or follow the verb. If an option is given twice, the last one counts, "
      "unless it accepts several values.\n";
  std::set<std::string> told;
  for (const OptionEntry& option : program.program.options)
    if (told.insert(option.group).second) page += options_of(program.program.options, option.group);
  told.erase("Options");
  page += ".SH VERBS\n";
  for (const VerbEntry& verb : program.verbs) {
    page += ".SS " + roff(verb.name) + "\n" + usage_of(verb) + "\n.PP\n" + flowing(verb.description) + ".\n";
    for (const OptionEntry& positional : verb.positionals)
      page += ".TP\n" + heading_of(positional) + "\n" + flowing(positional.description) + "\n";
    page += groups_of(verb, told);
    if (!verb.footer.empty()) page += ".PP\n" + footer_of(verb.footer);
  }
  return page +
         ".SH ENVIRONMENT\n"
         ".TP\n\\fBPACKTRACE_THREADS\\fR\nNumber of threads if \\fB\\-\\-threads\\fR is not given.\n"
         ".TP\n\\fBPACKTRACE_ISA\\fR\nInstruction set of the packed tracer: scalar, avx2 or avx512 (default: the "
         "best that the machine supports).\n"
         ".TP\n\\fBNO_COLOR\\fR\nIf set and not empty, output to a terminal has no colours.\n";
}

} // namespace packtrace
