// The parser's short way for directives in their common form, which skips the tokenizer. Whatever has another form is
// left to the tokenizer from its start on, so that all results and reports are the same.

#include <algorithm>
#include <tuple>

#include "pbrt_import/base/equal_text.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/language/token_text.h"

namespace packtrace {
namespace {

bool has_gap(std::string_view text) {
  return std::any_of(text.begin(), text.end(), [](char c) { return c == ' ' || c == '\t'; });
}

} // namespace

/// Reads the next directive, if it has the common form up to its parameters.
bool Parser::next_plain(Directive& directive) {
  PlainText text = source_.plain_text();
  const std::string_view word = text.peek_word();
  const DirectiveInfo* const info = find_directive(word);
  using K = DirectiveKind;
  if (!info || info->kind == K::kInclude || info->kind == K::kActiveTransform || info->kind == K::kMediumInterface)
    return false;
  text.take_word(word);
  const Place place{source_.file(), text.token_line(), text.token_column()};
  if (info->numbers > 0 && text.peek() == '[') {
    PlainText matrix = text; // a copy, so that `text` stays in registers
    if (!take_plain_matrix(matrix, info->numbers, directive.numbers)) return false;
    text = matrix;
  } else if (info->numbers > 0) {
    for (uint32_t i = 0; i < info->numbers; ++i)
      if (!text.take_number(scan_double, directive.numbers[i])) return false;
    if (!text.other_word_follows()) return false;
  }
  std::array<std::string_view, std::tuple_size_v<decltype(Directive::names)>> names;
  for (uint32_t i = 0; i < info->names; ++i)
    if (!text.take_string(names[i])) return false;
  begin(directive, *info, place);
  for (; directive.name_count < info->names; ++directive.name_count)
    directive.names[directive.name_count] = names[directive.name_count];
  source_.accept(text);
  if (info->parameters) read_parameters(directive.parameters);
  return true;
}

/// Reads exactly `count` numbers in brackets.
bool Parser::take_plain_matrix(PlainText& text, uint32_t count, std::array<double, 16>& numbers) {
  if (!text.take('[')) return false;
  const NumberSpans<double> values = source_.take_array<double>(text);
  if (values.size() != count) return false;
  std::copy(values.own.begin(), values.own.end(), numbers.begin());
  std::copy(values.integers.begin(), values.integers.end(), numbers.begin());
  return true;
}

/// Reads parameters as long as they have the common form.
/// @return whether a directive follows
bool Parser::take_plain_parameters(ParameterList& list) {
  while (take_plain_parameter(list)) {
  }
  return find_directive(source_.plain_text().peek_word()) != nullptr;
}

/// Type and name in a declaration of one type and one name with one space between them; null for others.
const Parser::PlainDeclaration* Parser::plain_declaration(std::string_view text) {
  if (text.empty()) return nullptr;
  const auto letter = [&](size_t i) { return static_cast<size_t>(static_cast<unsigned char>(text[i])); };
  PlainDeclaration& known =
      declarations_[(letter(0) * 5 + letter(text.size() - 1) * 3 + text.size()) % declarations_.size()];
  if (equal_text(known.text, text)) return &known;
  const size_t gap = text.find(' ');
  if (gap == text.npos || gap + 1 == text.size() || has_gap(text.substr(gap + 1))) return nullptr;
  const std::optional<ParameterType> type = parameter_type(text.substr(0, gap));
  constexpr size_t kLong = 64; // few are longer, and they need not be kept
  if (!type || text.size() > kLong) return nullptr;
  known = {std::string(text), *type, gap + 1};
  return &known;
}

/// Reads a parameter, if it has the common form.
bool Parser::take_plain_parameter(ParameterList& list) {
  PlainText text = source_.plain_text();
  std::string_view declaration;
  if (!text.take_string(declaration)) return false;
  const PlainDeclaration* const known = plain_declaration(declaration);
  if (!known) return false;
  const Place place{source_.file(), text.token_line(), text.token_column()};
  const uint64_t before = value_bytes_;
  value_bytes_ += kParameterBytes + declaration.size();
  Parameter& parameter = list.append();
  parameter.type = known->type;
  if (!take_plain_value(text, parameter) || value_bytes_ > kFreeBytes) {
    list.drop();
    value_bytes_ = before;
    return false;
  }
  parameter.name = declaration.substr(known->name_begin);
  parameter.place = place;
  source_.accept(text);
  keep_last(list);
  return true;
}

/// Reads the value of a parameter whose type is set.
bool Parser::take_plain_value(PlainText& text, Parameter& parameter) {
  const bool array = text.take('[');
  switch (parameter.type) {
  case ParameterType::kBool:
    return false;
  case ParameterType::kString:
  case ParameterType::kTexture: {
    std::string_view value;
    // A value with a gap might be the declaration of another parameter.
    if (!text.take_string(value) || has_gap(value)) return false;
    if (array && !text.take(']')) return false;
    value_bytes_ += 2 * sizeof(std::string) + value.size();
    parameter.strings.emplace_back(value);
    return true;
  }
  case ParameterType::kInteger: {
    int32_t single = 0;
    if (!array && !text.take_number_word(scan_integer, single)) return false;
    const std::span<const int32_t> values =
        array ? source_.take_array<int32_t>(text).integers : std::span<const int32_t>(&single, 1);
    value_bytes_ += values.size_bytes();
    parameter.integers.append(values);
    return !values.empty();
  }
  default: {
    float single = 0.0f;
    if (!array && !text.take_number_word(scan_float, single)) return false;
    const NumberSpans<float> values =
        array ? source_.take_array<float>(text) : NumberSpans<float>{std::span<const float>(&single, 1), {}};
    value_bytes_ += values.size() * sizeof(float);
    parameter.floats.append(values.own);
    parameter.floats.append(values.integers);
    return values.size() > 0;
  }
  }
}

} // namespace packtrace
