#include "pbrt_import/language/parser.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "pbrt_import/language/token_text.h"
#include "pbrt_import/text/number.h"

namespace packtrace {
namespace {

using K = DirectiveKind;

std::string count_of(size_t count, std::string_view thing) {
  return std::to_string(count) + " " + std::string(thing) + (count == 1 ? "" : "s");
}

/// Appends numbers, converted to the type of `values`.
template <class Number>
void append(std::vector<double>& values, std::span<const Number> more) {
  values.insert(values.end(), more.begin(), more.end());
}
template <class Number, class Triplet, class Other>
void append(NumberArray<Number, Triplet>& values, std::span<const Other> more) {
  values.append(more);
}

/// Like parse_number(), for a word in the tokenizer's window, behind which scanners may read.
template <class T>
NumberText<T> parse_word(std::string_view word) {
  NumberText<T> number;
  const char* end = nullptr;
  if constexpr (std::is_same_v<T, float>)
    end = scan_float(word.data(), number.value);
  else
    end = scan_double(word.data(), number.value);
  if (end != word.data() + word.size()) return parse_number<T>(word);
  number.used = word.size();
  return number;
}

} // namespace

bool Parser::next(Directive& directive) {
  if (next_plain(directive)) return true;
  while (true) {
    const Token& token = source_.peek();
    if (token.kind == TokenKind::kEnd) return false;
    const DirectiveInfo* const info = token.kind == TokenKind::kWord ? find_directive(token.text) : nullptr;
    if (!info) {
      const bool number = is_number(token);
      const bool word = token.kind == TokenKind::kWord && !number;
      std::string message = word     ? unknown_directive(token)
                            : number ? "expected a directive, found the number " + describe(token)
                                     : "expected a directive, found " + describe(token);
      if (token.kind != TokenKind::kBadByte) reporter_.error(source_.place(), std::move(message));
      const uint32_t line = token.line;
      source_.consume();
      skip_to_directive(line);
      continue;
    }
    begin(directive, *info, source_.place());
    source_.consume();
    if (!read_arguments(*info, directive)) {
      skip_to_directive(directive.place.line);
      if (info->kind == K::kInclude) continue;
      directive.damaged = true;
    }
    if (info->kind != K::kInclude) return true;
    const std::filesystem::path path = file_names_.resolve(include_name_, directive.place, reporter_);
    if (!path.empty()) source_.include(path, directive.place);
  }
}

void Parser::begin(Directive& directive, const DirectiveInfo& info, const Place& place) {
  reporter_.next_directive();
  directive.kind = info.kind;
  directive.keyword = info.keyword;
  directive.place = place;
  directive.name_count = 0;
  directive.damaged = false;
  directive.parameters.clear();
  if (directive.memory.bytes() > 0) directive.memory.release();
  if (!directive.memory.has_budget()) directive.memory = MemoryReservation(memory_);
  directive_ = &directive;
  value_bytes_ = 0;
}

bool Parser::read_arguments(const DirectiveInfo& info, Directive& directive) {
  if (info.numbers > 0) return read_directive_numbers(info, directive);
  if (info.kind == K::kActiveTransform) {
    const Token& token = source_.peek();
    if (token.kind != TokenKind::kWord) {
      report_unexpected("All, StartTime or EndTime after ActiveTransform", "; it is ignored");
      return false;
    }
    directive.names[directive.name_count++] = std::string(token.text);
    source_.consume();
    return true;
  }
  if (!read_directive_names(info, directive)) return false;
  if (info.parameters) read_parameters(directive.parameters);
  return true;
}

bool Parser::read_directive_numbers(const DirectiveInfo& info, Directive& directive) {
  numbers_.clear();
  read_number_run(numbers_);
  if (numbers_.empty() && source_.peek().kind == TokenKind::kOpen) {
    const Place open = source_.place();
    source_.consume();
    read_number_run(numbers_);
    if (source_.peek().kind != TokenKind::kClose) {
      reporter_.error(open, "\"[\" without its \"]\": found " + describe(source_.peek()) + " in the matrix");
      return false;
    }
    source_.consume();
  }
  if (numbers_.size() != info.numbers) {
    reporter_.error(directive.place, std::string(info.keyword) + " takes " + count_of(info.numbers, "number") +
                                         ", found " + std::to_string(numbers_.size()) + "; it is ignored");
    return false;
  }
  std::copy(numbers_.begin(), numbers_.end(), directive.numbers.begin());
  return true;
}

bool Parser::read_directive_names(const DirectiveInfo& info, Directive& directive) {
  while (directive.name_count < info.names) {
    const Token& token = source_.peek();
    if (token.kind != TokenKind::kString) {
      if (info.kind == K::kMediumInterface && directive.name_count == 1) return true;
      const std::string keyword(info.keyword);
      report_unexpected("a quoted name after " + keyword, "; " + keyword + " is ignored");
      if (token.kind == TokenKind::kWord && !is_directive(token)) source_.consume(); // already reported
      return false;
    }
    if (info.kind == K::kInclude) include_name_ = token.text;
    bool unknown_escape = false;
    if (token.text.find('\\') == std::string_view::npos)
      directive.names[directive.name_count++] = token.text;
    else
      directive.names[directive.name_count++] = unescape(token.text, unknown_escape);
    source_.consume();
  }
  return true;
}

/// Reports the current token as unexpected.
/// @param consequence end of the message, such as "; it is ignored"
void Parser::report_unexpected(const std::string& expected, const std::string& consequence) {
  const Token& token = source_.peek();
  const bool unterminated = token.kind == TokenKind::kUnterminatedString;
  reporter_.error(source_.place(), (unterminated ? "string without its closing quote: " + in_quotes(token.text)
                                                 : "expected " + expected + ", found " + describe(token)) +
                                       consequence);
}

/// Skips to the next directive, or to a word that may be meant as one: the first word of a line after `line`.
void Parser::skip_to_directive(uint32_t line) {
  while (source_.peek().kind != TokenKind::kEnd && !is_directive(source_.peek())) {
    const Token& token = source_.peek();
    if (token.line != line && token.kind == TokenKind::kWord && is_letter(token.text[0]) && !is_number(token)) return;
    line = token.line;
    source_.consume();
  }
}

template <class Values>
bool Parser::take_number(Values& values) {
  using T = typename Values::value_type;
  const Token& token = source_.peek();
  if (token.kind != TokenKind::kWord || !may_start_number(token.text[0])) return false;
  using Parsed = std::conditional_t<std::is_same_v<T, float>, float, double>;
  const NumberText<Parsed> number = parse_word<Parsed>(token.text);
  if (number.used == 0 || (is_letter(token.text[0]) && is_directive(token))) return false;
  if (number.used < token.text.size())
    reporter_.warning(source_.place(),
                      "number " + describe(token) + " has other characters after it; they are ignored");
  count_value(sizeof(T));
  if constexpr (std::is_same_v<T, int32_t>) {
    if (!(number.value >= std::numeric_limits<int32_t>::min() && number.value <= std::numeric_limits<int32_t>::max()))
      reporter_.warning(source_.place(), "integer " + describe(token) + " does not fit in 32 bits");
    else if (number.value != std::trunc(number.value))
      reporter_.warning(source_.place(), "integer expected, found " + describe(token) + "; the fraction is cut off");
    // NaN becomes the smallest integer, which is not a valid index or count.
    values.push_back(number.value > std::numeric_limits<int32_t>::max()   ? std::numeric_limits<int32_t>::max()
                     : number.value > std::numeric_limits<int32_t>::min() ? static_cast<int32_t>(number.value)
                                                                          : std::numeric_limits<int32_t>::min());
  } else {
    values.push_back(number.value);
  }
  source_.consume();
  return true;
}

template <class Values>
void Parser::read_number_run(Values& values) {
  const auto take = [&](auto numbers) {
    count_value(numbers.size() * sizeof(typename Values::value_type));
    append(values, numbers);
  };
  do {
    source_.read_numbers<typename Values::value_type>(take);
    if constexpr (!std::is_same_v<typename Values::value_type, int32_t>) // integers are checked as doubles
      for (typename Values::value_type value; source_.read_bare_number(value);) {
        count_value(sizeof value);
        values.push_back(value);
      }
  } while (take_number(values));
}

template bool Parser::take_number(IntegerArray& values);
template bool Parser::take_number(FloatArray& values);
template void Parser::read_number_run(IntegerArray& values);
template void Parser::read_number_run(FloatArray& values);

void Parser::reserve_values() {
  constexpr uint64_t kStep = 1u << 20; // a call for every number would take longer than parsing it
  directive_->memory.cover(value_bytes_ + kStep, "what the directive's parameters hold");
}

} // namespace packtrace
