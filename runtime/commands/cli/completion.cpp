#include "runtime/commands/cli/completion.h"

#include <algorithm>
#include <span>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// Shortens a description to its first clause, since completion lists are narrow.
std::string brief(const std::string& description) {
  std::string text = description;
  std::ranges::replace(text, '\n', ' ');
  for (const char* end : {"; ", ". ", ": "}) text = text.substr(0, text.find(end));
  return text;
}

/// Quotes text with single quotes for bash and zsh.
std::string quoted(const std::string& text) { return "'" + CLI::detail::find_and_replace(text, "'", R"('\'')") + "'"; }

/// Quotes text with single quotes for fish.
std::string fish_quoted(const std::string& text) {
  const std::string slashes = CLI::detail::find_and_replace(text, "\\", "\\\\");
  return "'" + CLI::detail::find_and_replace(slashes, "'", "\\'") + "'";
}

std::vector<std::string> names_of(const OptionEntry& option) {
  std::vector<std::string> names = option.short_names;
  names.insert(names.end(), option.long_names.begin(), option.long_names.end());
  return names;
}

std::string verb_list(const ProgramEntry& program) {
  std::string names;
  for (const VerbEntry& verb : program.verbs) names += (names.empty() ? "" : " ") + verb.name;
  return names;
}

// --- bash

/// Bash command that fills the list of completions. It reads one completion per line, because names may contain spaces.
/// @param what arguments of compgen
std::string bash_offer(const std::string& what) {
  return "mapfile -t COMPREPLY < <(compgen " + what + " -- \"$current\")";
}

std::string bash_words(const std::vector<std::string>& words) {
  return fmt::format("-W \"{}\"", fmt::join(words, " "));
}

/// Bash command that completes the value of an option; empty if the value is free text.
std::string bash_value(const OptionEntry& option) {
  switch (option.value) {
  case ValueKind::kChoice: // an optional value may be omitted, so the next word may also be a file
    return bash_offer(bash_words(option.choices) + (option.value_optional ? " -f" : ""));
  case ValueKind::kFile:
    return bash_offer("-f");
  case ValueKind::kFolder:
    return bash_offer("-d");
  default:
    return {};
  }
}

std::string bash_verb(const VerbEntry& verb) {
  std::string arms;
  std::vector<std::string> options, positionals;
  for (const OptionEntry& option : verb.options) {
    const std::vector<std::string> names = names_of(option);
    options.insert(options.end(), names.begin(), names.end());
    if (option.value == ValueKind::kNoValue) continue;
    const std::string value = bash_value(option);
    arms += fmt::format("        {}) {}return ;;\n", fmt::join(names, "|"), value.empty() ? "" : value + "; ");
  }
  for (const OptionEntry& positional : verb.positionals)
    positionals.insert(positionals.end(), positional.choices.begin(), positional.choices.end());
  return fmt::format("    {})\n      case $previous in\n{}      esac\n"
                     "      if [[ $current == -* ]]; then {}\n      else {}; fi ;;\n",
                     verb.name.empty() ? "''" : verb.name, arms, bash_offer(bash_words(options)),
                     bash_offer(positionals.empty() ? "-f" : bash_words(positionals)));
}

std::string bash_script(const ProgramEntry& program) {
  VerbEntry before = program.program; // the part before the verb; its positional is the verb
  before.name.clear();
  OptionEntry verbs;
  for (const VerbEntry& verb : program.verbs) verbs.choices.push_back(verb.name);
  before.positionals = {verbs};
  std::string script = "# Completion of packtrace for bash. Made by: packtrace completion bash\n"
                       "_packtrace() {\n"
                       "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} verb='' i\n"
                       "  # An option and its value may be joined by \"=\", which is a word of its own here.\n"
                       "  if [[ $current == '=' ]]; then current=''\n"
                       "  elif [[ $previous == '=' ]]; then previous=${COMP_WORDS[COMP_CWORD-2]}; fi\n"
                       "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
                       "    case ${COMP_WORDS[i]} in\n";
  script += fmt::format("      {}) verb=${{COMP_WORDS[i]}}; break ;;\n",
                        CLI::detail::find_and_replace(verb_list(program), " ", "|"));
  script += "    esac\n  done\n  COMPREPLY=()\n  case $verb in\n" + bash_verb(before);
  for (const VerbEntry& verb : program.verbs) script += bash_verb(verb);
  return script + "  esac\n}\ncomplete -o filenames -F _packtrace packtrace\n";
}

// --- zsh

/// Escapes the special characters of zsh's _arguments.
std::string zsh_text(const std::string& text) {
  std::string escaped;
  for (const char c : brief(text)) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

std::string zsh_value(const OptionEntry& option) {
  if (option.value == ValueKind::kNoValue) return {};
  std::string start = (option.value_optional ? "::" : ":") + option.value_name + ":";
  switch (option.value) {
  case ValueKind::kChoice:
    return start + fmt::format("({})", fmt::join(option.choices, " "));
  case ValueKind::kFile:
    return start + "_files";
  case ValueKind::kFolder:
    return start + "_files -/";
  default:
    return start;
  }
}

std::string zsh_arguments(const VerbEntry& verb) {
  std::string lines;
  for (const OptionEntry& option : verb.options)
    for (const std::string& name : names_of(option)) {
      // "=" allows the value after an equals sign or as the next word; "+" does the same for short names.
      const char* joint = option.value == ValueKind::kNoValue ? "" : name.starts_with("--") ? "=" : "+";
      if (option.value_optional) joint = "=-"; // only after "=", because the next word may be the scene
      lines += " \\\n        " + quoted(fmt::format("{}{}{}[{}]{}", option.repeatable ? "*" : "", name, joint,
                                                    zsh_text(option.description), zsh_value(option)));
    }
  for (const OptionEntry& positional : verb.positionals)
    lines += " \\\n        " +
             quoted((positional.repeatable ? "*" : "") + (zsh_value(positional).empty() ? ":" : zsh_value(positional)));
  return lines;
}

std::string zsh_script(const ProgramEntry& program) {
  std::string script = "#compdef packtrace\n"
                       "# Completion of packtrace for zsh. Made by: packtrace completion zsh\n"
                       "_packtrace() {\n"
                       "  local curcontext=\"$curcontext\" state line\n"
                       "  typeset -A opt_args\n"
                       "  local -a verbs\n"
                       "  verbs=(\n";
  for (const VerbEntry& verb : program.verbs)
    script += "    " + quoted(verb.name + ":" + zsh_text(verb.description)) + "\n";
  VerbEntry before = program.program;
  before.positionals.clear();
  script += "  )\n  _arguments -C" + zsh_arguments(before) +
            " \\\n        '1: :->verb' '*:: :->rest' && return\n"
            "  case $state in\n"
            "    verb) _describe verb verbs ;;\n"
            "    rest)\n      case $words[1] in\n";
  for (const VerbEntry& verb : program.verbs)
    script += fmt::format("      {}) _arguments{} ;;\n", verb.name, zsh_arguments(verb));
  return script +
         "      esac ;;\n  esac\n}\n"
         "if [[ $funcstack[1] == _packtrace ]]; then _packtrace \"$@\"; else compdef _packtrace packtrace; fi\n";
}

// --- fish

std::string fish_option(const OptionEntry& option, const std::string& condition) {
  std::string line = "complete -c packtrace -n " + fish_quoted(condition);
  for (const std::string& name : option.short_names) line += " -s " + name.substr(1);
  for (const std::string& name : option.long_names) line += " -l " + name.substr(2);
  switch (option.value_optional ? ValueKind::kText : option.value) {
  case ValueKind::kChoice:
    line += fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
    break;
  case ValueKind::kFile:
    line += " -r -F";
    break;
  case ValueKind::kFolder:
    line += " -x -a '(__fish_complete_directories)'";
    break;
  case ValueKind::kText:
    if (!option.value_optional) line += " -x";
    break;
  case ValueKind::kNoValue:
    break;
  }
  return line + " -d " + fish_quoted(brief(option.description)) + "\n";
}

std::string fish_script(const ProgramEntry& program) {
  const std::string verbs = verb_list(program), none = "not __fish_seen_subcommand_from " + verbs;
  std::string script = "# Completion of packtrace for fish. Made by: packtrace completion fish\n";
  for (const OptionEntry& option : program.program.options) script += fish_option(option, none);
  for (const VerbEntry& verb : program.verbs)
    script += fmt::format("complete -c packtrace -n '{}' -f -a {} -d {}\n", none, verb.name,
                          fish_quoted(brief(verb.description)));
  for (const VerbEntry& verb : program.verbs) {
    const std::string seen = "__fish_seen_subcommand_from " + verb.name;
    for (const OptionEntry& option : verb.options) script += fish_option(option, seen);
    for (const OptionEntry& positional : verb.positionals)
      if (!positional.choices.empty())
        script += fmt::format("complete -c packtrace -n '{}' -f -a '{}'\n", seen, fmt::join(positional.choices, " "));
  }
  return script;
}

} // namespace

const std::vector<std::string>& completion_shells() {
  static const std::vector<std::string> kShells{"bash", "zsh", "fish"};
  return kShells;
}

std::string completion_script(const ProgramEntry& program, std::string_view shell) {
  if (shell == "bash") return bash_script(program);
  if (shell == "zsh") return zsh_script(program);
  if (shell == "fish") return fish_script(program);
  throw Error(ErrorKind::kUsage, "no completion for the shell " + std::string(shell));
}

} // namespace packtrace
