#include "runtime/commands/cli/help_formatter.h"

#include <algorithm>
#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <sys/ioctl.h>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

constexpr size_t kNames = 28; // columns of option names

/// Returns the columns left for descriptions: those of the terminal, within limits, or of 80 where there is none.
size_t description_columns() {
  constexpr size_t kUsual = 80, kMinColumns = 60, kMaxColumns = 112;
  size_t columns = kUsual;
  winsize size{};
  if (is_terminal(stdout) && ioctl(fileno(stdout), TIOCGWINSZ, &size) == 0 && size.ws_col > 0) columns = size.ws_col;
  return std::clamp(columns, kMinColumns, kMaxColumns) - kNames - 1;
}

/// Wraps text between words to lines of at most that many columns. Longer words get a separate line.
std::string wrapped(const std::string& text, size_t columns) {
  std::string result;
  size_t column = 0;
  for (const std::string& word : CLI::detail::split(CLI::detail::find_and_replace(text, "\n", " "), ' ')) {
    if (word.empty()) continue;
    const bool fits = column + 1 + word.size() <= columns;
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
  return wrapped(text, description_columns());
}

} // namespace packtrace
