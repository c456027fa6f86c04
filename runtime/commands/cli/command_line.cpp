#include "runtime/commands/cli/command_line.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

std::vector<CLI::App*> shown_verbs(CLI::App& app) {
  return app.get_subcommands([](CLI::App* verb) { return !verb->get_group().empty(); });
}

std::string nearest_of(std::string_view name, const std::vector<std::string>& names) {
  const std::vector<std::string_view> known(names.begin(), names.end());
  return did_you_mean_text(closest_name(name, known));
}

constexpr const char* kProgram = "packtrace";

/// Returns "packtrace bake" for a verb, "packtrace" for the program.
std::string command_of(const CLI::App& app) { return app.get_parent() ? kProgram + (" " + app.get_name()) : kProgram; }

std::string no_such_option(CLI::App& app, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options({}))
    for (const std::string& known : option->get_lnames()) names.push_back("--" + known);
  return name + ": no such option" + nearest_of(name, names);
}

[[noreturn]] void fail_without_verb(CLI::App& app, const std::string& word) {
  std::error_code ignored;
  if (word.find_first_of("./") != std::string::npos || std::filesystem::exists(word, ignored)) {
    const std::string file = shell_word(word);
    const std::string stem = std::filesystem::path(word).stem().string();
    const std::string example = ending_of(word) == ".ptk" ? "render " + file + " -o " + shell_word(stem + ".png")
                                                          : "bake " + file + " -o " + shell_word(stem + ".ptk");
    throw Error(ErrorKind::kUsage, fmt::format("{}: no verb given, for example {} {}, or {} info {}", word, kProgram,
                                               example, kProgram, file));
  }
  std::vector<std::string> names;
  for (const CLI::App* verb : shown_verbs(app)) names.push_back(verb->get_name());
  throw Error(ErrorKind::kUsage,
              fmt::format("unknown verb '{}'{}; verbs are {}", word, nearest_of(word, names), verb_names(app)));
}

/// Whether a word requests help or the version, which need no verb.
bool asks_for_help(const CLI::App& app, const std::string& word) {
  const auto is = [&](const CLI::Option* option) { return option && option->check_name(word); };
  return is(app.get_help_ptr()) || is(app.get_version_ptr());
}

/// Throws Error(kUsage) if the verb is missing or unknown. CLI11 would report "a subcommand is required" for both.
void require_verb(CLI::App& app, const std::vector<std::string>& words) {
  for (size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--") break;
    if (!word.starts_with("-") || word == "-") {
      if (!find_verb(app, word)) fail_without_verb(app, word);
      return;
    }
    if (asks_for_help(app, word)) return;
    const CLI::Option* option = app.get_option_no_throw(word.substr(0, word.find('=')));
    if (!option && !word.starts_with("--") && word.size() > 2) option = app.get_option_no_throw(word.substr(0, 2));
    if (!option) throw Error(ErrorKind::kUsage, no_such_option(app, word) + " (see packtrace --help)");
    if (option->get_items_expected_max() > 0 && app.get_option_no_throw(word)) ++i;
  }
  throw Error(ErrorKind::kUsage, "no verb given; verbs are " + verb_names(app) + " (see packtrace --help)");
}

/// Error message for the command line of a verb.
std::string message_of(const CLI::ParseError& error, CLI::App& verb) {
  std::string text = error.what();
  if (dynamic_cast<const CLI::ExtrasError*>(&error)) {
    std::vector<std::string> left = verb.remaining();
    const auto mark = std::ranges::find(left, "--"); // words after "--" are never options
    const auto given = std::find_if(left.begin(), mark, [](const std::string& word) { return word.starts_with("-"); });
    if (given != mark) return no_such_option(verb, *given);
    std::erase(left, "--");
    if (!left.empty()) return left.front() + ": unexpected argument";
  }
  if (dynamic_cast<const CLI::ConversionError*>(&error)) {
    constexpr std::string_view kBefore = "Could not convert: ", kBetween = " = ";
    const size_t between = text.find(kBetween);
    if (text.starts_with(kBefore) && between != std::string::npos)
      return fmt::format("{}: '{}' is not a valid number", text.substr(kBefore.size(), between - kBefore.size()),
                         text.substr(between + kBetween.size()));
  }
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) return text.substr(0, text.find(':')) + " needs a value";
  return text;
}

} // namespace

bool parse_command_line(CLI::App& app, std::span<const char* const> words) {
  std::vector<std::string> plain = normalised_arguments(app, words);
  require_verb(app, plain);
  app.require_subcommand(1);
  try {
    std::ranges::reverse(plain); // App::parse() expects the words in reverse order
    app.parse(std::move(plain));
    return true;
  } catch (const CLI::Success& success) {
    app.exit(success);
    return false;
  } catch (const CLI::ParseError& error) {
    const auto verbs = app.get_subcommands();
    CLI::App& verb = verbs.empty() ? app : *verbs.front();
    throw Error(ErrorKind::kUsage, message_of(error, verb) + " (see " + command_of(verb) + " --help)");
  }
}

std::string verb_in_words(CLI::App& app, std::span<const char* const> words) {
  for (const std::string_view word : words)
    if (const CLI::App* verb = find_verb(app, std::string(word))) return verb->get_name();
  return {};
}

std::string verb_names(CLI::App& app) {
  std::string names;
  for (const CLI::App* verb : shown_verbs(app)) names += (names.empty() ? "" : ", ") + verb->get_name();
  return names;
}

} // namespace packtrace
