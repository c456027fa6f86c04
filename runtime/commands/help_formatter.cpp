#include "runtime/commands/help_formatter.h"

#include <string>

#include <fmt/format.h>

#include "runtime/commands/option_checks.h"

namespace packtrace {
namespace {

constexpr size_t kNames = 28, kDescription = 84; // columns

/// Wraps text between words to lines of at most kDescription columns. Longer words get a line of their own.
std::string wrapped(const std::string& text) {
  std::string result;
  size_t column = 0;
  for (const std::string& word : CLI::detail::split(CLI::detail::find_and_replace(text, "\n", " "), ' ')) {
    if (word.empty()) continue;
    const bool fits = column + 1 + word.size() <= kDescription;
    if (!result.empty()) result += fits ? " " : "\n";
    column = fits && !result.empty() ? column + 1 + word.size() : word.size();
    result += word;
  }
  return result;
}

} // namespace

HelpFormatter::HelpFormatter() {
  column_width(kNames);
  label("SUBCOMMAND", "VERB");
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  if (option->get_items_expected_max() == 0) return {};
  const std::vector<std::string> choices = choices_of(*option);
  std::string text = choices.empty() ? value_name(*option) : fmt::format("{{{}}}", fmt::join(choices, ","));
  if (option->get_positional() && choices.empty()) text.clear(); // a positional's name already describes its value
  if (has_optional_value(*option)) text = "[" + text + "]";
  if (option->get_required()) text += " (required)";
  return text.empty() ? text : " " + text;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  std::string text = option->get_description();
  const std::string& value = option->get_default_str();
  if (!value.empty() && !has_optional_value(*option) && text.find("(default") == std::string::npos)
    text += " (default " + value + ")";
  return wrapped(text);
}

} // namespace packtrace
