// Parameters of directives: declarations, values and arrays.

#include "pbrt_import/language/parser.h"

#include <algorithm>
#include <utility>

#include "pbrt_import/language/token_text.h"

namespace packtrace {
namespace {

bool is_numeric(ParameterType type) {
  return type != ParameterType::kString && type != ParameterType::kTexture && type != ParameterType::kBool;
}

/// The words of a parameter declaration; missing words are empty.
struct DeclaredWords {
  std::string_view type, name, more;
};

DeclaredWords split_declaration(std::string_view text) {
  const auto is_gap = [](char c) { return c == ' ' || c == '\t'; };
  const auto* p = text.begin();
  const auto word = [&] {
    p = std::find_if_not(p, text.end(), is_gap);
    const auto* const start = p;
    p = std::find_if(p, text.end(), is_gap);
    return std::string_view(start, p);
  };
  DeclaredWords words;
  words.type = word();
  words.name = word();
  words.more = word();
  return words;
}

/// Whether a string is a parameter declaration rather than a value.
bool declares(std::string_view text) {
  const DeclaredWords words = split_declaration(text);
  return parameter_type(words.type) && !words.name.empty() && words.more.empty();
}

/// Number of components per value; the count of numbers must be a multiple of it.
size_t components(ParameterType type) {
  switch (type) {
  case ParameterType::kPoint2:
  case ParameterType::kVector2:
  case ParameterType::kBlackbody:
  case ParameterType::kSpectrum:
    return 2;
  case ParameterType::kPoint3:
  case ParameterType::kVector3:
  case ParameterType::kNormal:
  case ParameterType::kRgb:
  case ParameterType::kXyz:
    return 3;
  default:
    return 1;
  }
}

} // namespace

/// Reads all parameters up to the next directive. Malformed input costs the parameter that it belongs to and no other.
void Parser::read_parameters(ParameterList& list) {
  while (true) {
    if (!misread_declaration_ && take_plain_parameters(list)) return;
    if (misread_declaration_) {
      count_value(kParameterBytes + misread_declaration_->text.size());
      Parameter& parameter = list.append();
      parameter.place = misread_declaration_->place;
      const bool declared = read_declaration(std::exchange(misread_declaration_, std::nullopt)->text, parameter);
      read_value_of_last(list, declared);
      continue;
    }
    const Token& token = source_.peek();
    if (token.kind == TokenKind::kEnd || is_directive(token)) return;
    if (token.kind == TokenKind::kString) {
      count_value(kParameterBytes + token.text.size());
      Parameter& parameter = list.append();
      parameter.place = source_.place();
      const bool declared = read_declaration(token.text, parameter);
      source_.consume();
      read_value_of_last(list, declared);
    } else if (token.kind == TokenKind::kWord && !is_number(token)) {
      if (!skip_stray_word()) return;
    } else {
      skip_stray_value(list);
    }
  }
}

/// Reads the value of the parameter that was appended last, and drops the parameter if it has no usable value.
/// @param declared whether its type and name are known
void Parser::read_value_of_last(ParameterList& list, bool declared) {
  if (!declared) skip_value();
  if (!declared || !read_values(list.last())) return list.drop();
  keep_last(list);
}

void Parser::keep_last(ParameterList& list) {
  cut_excess(list.last());
  if (const Parameter* const again = list.keep())
    reporter_.warning(again->place, "parameter " + describe(*again) + " is given again; the last one counts");
}

/// Handles an unexpected word among parameters. If a parameter declaration follows, only the word is skipped; otherwise
/// it is treated as a misspelled directive and skipped with its arguments.
/// @return whether more parameters follow
bool Parser::skip_stray_word() {
  const Place place = source_.place();
  const std::string stray = "expected a parameter or a directive, found " + describe(source_.peek());
  const std::string unknown = unknown_directive(source_.peek());
  source_.consume();
  const Token& next = source_.peek();
  const bool goes_on = next.kind == TokenKind::kString && declares(next.text);
  reporter_.error(place, goes_on ? stray + "; it is ignored" : unknown);
  if (!goes_on) skip_to_directive(place.line);
  return goes_on;
}

/// Skips a token that cannot start a parameter: a value, a bracket or an unterminated string.
void Parser::skip_stray_value(const ParameterList& list) {
  const std::string after = list.empty() ? "" : " after " + describe(list.all().back());
  const Token& token = source_.peek();
  const bool array = token.kind == TokenKind::kOpen, number = token.kind == TokenKind::kWord;
  const bool declaration = token.kind == TokenKind::kUnterminatedString;
  if (number)
    reporter_.error(source_.place(), "expected a parameter or a directive" + after + ", found the number " +
                                         describe(token) + "; numbers are ignored here");
  else if (token.kind != TokenKind::kBadByte)
    report_unexpected("a parameter or a directive" + after, "; it is ignored");
  if (array) return skip_value();
  do source_.consume();
  while (number && is_number(source_.peek()));
  if (declaration) skip_value();
}

bool Parser::read_declaration(std::string_view text, Parameter& parameter) {
  const DeclaredWords words = split_declaration(text);
  const std::optional<ParameterType> type = parameter_type(words.type);
  if (type && !words.name.empty()) {
    parameter.type = *type;
    parameter.name = std::string(words.name);
    if (!words.more.empty())
      reporter_.warning(parameter.place, in_quotes(text) + " has more than a type and a name; the rest is ignored");
    return true;
  }
  if (!type && !words.name.empty())
    reporter_.error(parameter.place, "unknown parameter type " + in_quotes(words.type) + " in " + in_quotes(text) +
                                         "; the parameter is ignored" +
                                         did_you_mean(closest_parameter_type(words.type)));
  else
    reporter_.error(parameter.place,
                    "a parameter is declared as \"type name\", found " + in_quotes(text) + "; it is ignored");
  return false;
}

/// Skips the presumed value of a parameter whose declaration is malformed.
void Parser::skip_value() {
  const TokenKind kind = source_.peek().kind;
  if (kind == TokenKind::kOpen) {
    source_.consume();
    skip_array_rest();
  } else if (kind == TokenKind::kString ? !declares(source_.peek().text)
                                        : kind == TokenKind::kWord && !is_directive(source_.peek())) {
    source_.consume();
  }
}

/// Skips past the array's "]", or up to a token that shows that it is missing: a directive or the next parameter.
void Parser::skip_array_rest() {
  while (true) {
    const Token& token = source_.peek();
    if (token.kind == TokenKind::kEnd || is_directive(token)) return;
    if (token.kind == TokenKind::kString && declares(token.text)) return;
    const bool closed = token.kind == TokenKind::kClose;
    source_.consume();
    if (closed) return;
  }
}

bool Parser::read_values(Parameter& parameter) {
  return source_.peek().kind == TokenKind::kOpen ? read_array(parameter) : read_single(parameter);
}

bool Parser::read_single(Parameter& parameter) {
  const Place place = source_.place();
  const bool taken = parameter.type == ParameterType::kInteger ? take_number(parameter.integers)
                     : parameter.type == ParameterType::kBool  ? take_bool(parameter)
                     : is_numeric(parameter.type)              ? take_number(parameter.floats) || take_string(parameter)
                                                               : take_string(parameter);
  if (!taken) {
    const Token& token = source_.peek();
    report_unexpected("a value for parameter " + in_quotes(parameter.name), "; the parameter is ignored");
    const bool next_parameter = token.kind == TokenKind::kString && declares(token.text);
    if (!next_parameter && !is_directive(token) && token.kind != TokenKind::kEnd) source_.consume();
    return false;
  }
  if (parameter.strings.empty() || !declares(parameter.strings[0])) return true;
  // If the string read as the value is a declaration followed by a value, then the value of this parameter is missing.
  const Token& next = source_.peek();
  const bool has_value =
      next.kind == TokenKind::kOpen || is_number(next) || (next.kind == TokenKind::kString && !declares(next.text));
  if (!has_value) return true;
  misread_declaration_ = Declaration{std::move(parameter.strings[0]), place};
  reporter_.error(place, "expected a value for parameter " + in_quotes(parameter.name) + ", found the parameter " +
                             in_quotes(misread_declaration_->text) + "; the parameter is ignored");
  return false;
}

bool Parser::read_array(Parameter& parameter) {
  const Place open = source_.place();
  Place last = open;
  source_.consume();
  while (true) {
    if (parameter.type == ParameterType::kInteger)
      read_number_run(parameter.integers);
    else if (is_numeric(parameter.type))
      read_number_run(parameter.floats);
    const Token& token = source_.peek();
    if (token.kind == TokenKind::kClose) {
      source_.consume();
      return true;
    }
    const auto runs_into = [&](const std::string& what) {
      reporter_.error(open, "\"[\" without its \"]\": the values of parameter " + in_quotes(parameter.name) +
                                " run into " + what + "; the parameter is ignored");
      return false;
    };
    if (token.kind == TokenKind::kEnd || is_directive(token)) return runs_into(describe(token));
    const bool text = parameter.type == ParameterType::kString || parameter.type == ParameterType::kTexture;
    if (!text && token.kind == TokenKind::kString && declares(token.text)) return runs_into(describe(token));
    if (text && !parameter.strings.empty() && (token.kind == TokenKind::kOpen || is_number(token)) &&
        declares(parameter.strings.back())) { // the last string is a declaration, because a value follows it
      misread_declaration_ = Declaration{std::move(parameter.strings.back()), last};
      return runs_into("the parameter " + in_quotes(misread_declaration_->text));
    }
    last = source_.place();
    if (parameter.type == ParameterType::kBool ? take_bool(parameter) : take_string(parameter)) continue;
    report_unexpected(std::string(is_numeric(parameter.type) ? "a number" : "a string") + " or \"]\" in parameter " +
                          in_quotes(parameter.name),
                      "; the parameter is ignored");
    skip_array_rest();
    return false;
  }
}

bool Parser::take_string(Parameter& parameter) {
  const Token& token = source_.peek();
  if (token.kind != TokenKind::kString) return false;
  if (is_numeric(parameter.type) && (parameter.type != ParameterType::kSpectrum || declares(token.text))) return false;
  count_value(2 * sizeof(std::string) + token.text.size());
  parameter.strings.emplace_back(token.text);
  source_.consume();
  return true;
}

bool Parser::take_bool(Parameter& parameter) {
  const Token& token = source_.peek();
  if (token.kind != TokenKind::kString && token.kind != TokenKind::kWord) return false;
  if (token.text != "true" && token.text != "false") {
    if (token.kind == TokenKind::kWord || declares(token.text)) return false;
    reporter_.warning(source_.place(), in_quotes(token.text) + " is neither \"true\" nor \"false\"; read as false");
  }
  parameter.integers.push_back(token.text == "true");
  source_.consume();
  return true;
}

void Parser::cut_excess(Parameter& parameter) {
  const size_t excess = parameter.floats.size() % components(parameter.type);
  if (excess == 0) return;
  reporter_.warning(parameter.place, "parameter " + describe(parameter) + " takes values in groups of " +
                                         std::to_string(components(parameter.type)) + ", found " +
                                         std::to_string(parameter.floats.size()) + "; the last " +
                                         std::to_string(excess) + " are ignored");
  parameter.floats.truncate(parameter.floats.size() - excess);
}

} // namespace packtrace
