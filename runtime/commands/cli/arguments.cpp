// normalised_arguments(): the words of a command line before CLI11 reads them.

#include "runtime/commands/cli/command_line.h"

#include <algorithm>
#include <filesystem>
#include <string_view>

#include <CLI/CLI.hpp>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

constexpr std::string_view kSize = "WxH"; // the type name of --size

bool is_number(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Returns the option named by a word such as "--output", "--output=x", "-o" or "-o=x"; null for other words.
CLI::Option* option_of(CLI::App& app, const std::string& word) {
  if (word.size() < 2 || word[0] != '-') return nullptr;
  const std::string name = word.substr(0, word.find('='));
  return app.get_option_no_throw(name);
}

/// Whether a word is meant as the value of an option with an optional value. True for all words that do not look like a
/// file or an option, including misspelt values, which the option's check then reports.
bool is_meant_as_value(CLI::Option& option, const std::string& word) {
  const std::vector<std::string> choices = choices_of(option);
  if (std::ranges::find(choices, word) != choices.end()) return true;
  std::error_code ignored;
  return !word.starts_with("-") && word.find_first_of("./") == std::string::npos &&
         !std::filesystem::exists(word, ignored);
}

class Words {
public:
  Words(CLI::App& app, std::span<const char* const> words) : app_(&app), words_(words.begin(), words.end()) {}

  std::vector<std::string> plain() {
    while (next_ < words_.size()) {
      const std::string word = take();
      if (word == "--") {
        plain_.push_back(word);
        plain_.insert(plain_.end(), words_.begin() + static_cast<std::ptrdiff_t>(next_), words_.end());
        break;
      }
      if (CLI::Option* option = option_of(*app_, word))
        add_option(*option, word);
      else
        add_other(word);
    }
    return std::move(plain_);
  }

private:
  std::string take() { return words_[next_++]; }
  bool has_next() const { return next_ < words_.size(); }

  void add_other(const std::string& word) {
    if (word.empty()) throw Error(ErrorKind::kUsage, "an argument is empty; expected a verb or a file");
    if (app_->get_parent() == nullptr)
      if (CLI::App* verb = find_verb(*app_, word)) app_ = verb;
    plain_.push_back(word);
  }

  void add_option(CLI::Option& option, const std::string& word) {
    const size_t equals = word.find('=');
    const bool takes_value = option.get_items_expected_max() > 0;
    if (equals != std::string::npos && !word.starts_with("--") && takes_value) { // -o=x
      plain_.push_back(word.substr(0, equals));
      plain_.push_back(word.substr(equals + 1));
    } else if (equals != std::string::npos || !takes_value) {
      plain_.push_back(word);
    } else if (has_optional_value(option)) {
      const bool given = has_next() && is_meant_as_value(option, words_[next_]);
      plain_.push_back(word + "=" + (given ? take() : option.get_flag_value(option.get_lnames().front(), "")));
    } else {
      plain_.push_back(word);
      if (has_next()) add_value(option, word);
    }
  }

  void add_value(const CLI::Option& option, const std::string& name) {
    std::string value = take();
    const bool is_verb = app_->get_parent() == nullptr && find_verb(*app_, value) != nullptr;
    if (value == "--" || is_verb || option_of(*app_, value) != nullptr)
      throw Error(ErrorKind::kUsage, name + " needs a value, but " + value + " follows; write " + name +
                                         (name.starts_with("--") ? "=" : " ./") + value + " if this is the value");
    if (value_name(option) == kSize && is_number(value) && has_next() && is_number(words_[next_]))
      value += "x" + take();
    plain_.push_back(value);
  }

  CLI::App* app_; ///< the program, or the verb once its name was read
  std::vector<std::string> words_, plain_;
  size_t next_ = 0;
};

} // namespace

std::vector<std::string> normalised_arguments(CLI::App& app, std::span<const char* const> words) {
  return Words(app, words).plain();
}

std::string value_in_words(std::span<const char* const> words, const std::string& name) {
  std::string value;
  for (size_t i = 0; i < words.size(); ++i) {
    const std::string_view word = words[i];
    if (word == "--") break;
    if (word.starts_with(name + "=")) value = word.substr(name.size() + 1);
    if (word != name || i + 1 == words.size()) continue;
    const std::string_view next = words[i + 1];
    if (next == "-" || !next.starts_with("-")) value = next;
  }
  return value;
}

} // namespace packtrace
