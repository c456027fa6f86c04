#include "pbrt_import/parser.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "pbrt_import/number.h"

namespace packtrace {

struct DirectiveInfo {
  std::string_view keyword;
  DirectiveKind kind;
  uint8_t numbers = 0;
  uint8_t names = 0;
  bool parameters = false;
};

namespace {

using K = DirectiveKind;

std::string count_of(size_t count, std::string_view thing) {
  return std::to_string(count) + " " + std::string(thing) + (count == 1 ? "" : "s");
}

std::string describe(const Token& token) {
  switch (token.kind) {
  case TokenKind::kWord:
    return in_quotes(token.text);
  case TokenKind::kString:
    return "the string " + in_quotes(token.text);
  case TokenKind::kOpen:
    return "\"[\"";
  case TokenKind::kClose:
    return "\"]\"";
  case TokenKind::kUnterminatedString:
    return "a string without its closing quote";
  case TokenKind::kBadByte:
    return "a stray byte";
  case TokenKind::kEnd:
    return "the end of the file";
  }
  return {};
}

constexpr DirectiveInfo kInfos[] = {
    {"Accelerator", K::kAccelerator, 0, 1, true},
    {"ActiveTransform", K::kActiveTransform, 0, 1, false},
    {"AreaLightSource", K::kAreaLightSource, 0, 1, true},
    {"AttributeBegin", K::kAttributeBegin},
    {"AttributeEnd", K::kAttributeEnd},
    {"Camera", K::kCamera, 0, 1, true},
    {"ConcatTransform", K::kConcatTransform, 16},
    {"CoordSysTransform", K::kCoordSysTransform, 0, 1, false},
    {"CoordinateSystem", K::kCoordinateSystem, 0, 1, false},
    {"Film", K::kFilm, 0, 1, true},
    {"Identity", K::kIdentity},
    {"Include", K::kInclude, 0, 1, false},
    {"Integrator", K::kIntegrator, 0, 1, true},
    {"LightSource", K::kLightSource, 0, 1, true},
    {"LookAt", K::kLookAt, 9},
    {"MakeNamedMaterial", K::kMakeNamedMaterial, 0, 1, true},
    {"MakeNamedMedium", K::kMakeNamedMedium, 0, 1, true},
    {"Material", K::kMaterial, 0, 1, true},
    {"MediumInterface", K::kMediumInterface, 0, 2, false},
    {"NamedMaterial", K::kNamedMaterial, 0, 1, false},
    {"ObjectBegin", K::kObjectBegin, 0, 1, false},
    {"ObjectEnd", K::kObjectEnd},
    {"ObjectInstance", K::kObjectInstance, 0, 1, false},
    {"PixelFilter", K::kPixelFilter, 0, 1, true},
    {"ReverseOrientation", K::kReverseOrientation},
    {"Rotate", K::kRotate, 4},
    {"Sampler", K::kSampler, 0, 1, true},
    {"Scale", K::kScale, 3},
    {"Shape", K::kShape, 0, 1, true},
    {"Texture", K::kTexture, 0, 3, true},
    {"Transform", K::kTransform, 16},
    {"TransformBegin", K::kTransformBegin},
    {"TransformEnd", K::kTransformEnd},
    {"TransformTimes", K::kTransformTimes, 2},
    {"Translate", K::kTranslate, 3},
    {"WorldBegin", K::kWorldBegin},
    {"WorldEnd", K::kWorldEnd},
};
static_assert(std::size(kInfos) == 37);

constexpr size_t kSlots = 128;

/// Few collisions among the keywords, and independent of a word's length.
constexpr size_t slot_of(std::string_view word) {
  const auto letter = [&](size_t i) { return static_cast<size_t>(static_cast<unsigned char>(word[i])); };
  return (letter(0) * 5 + letter(word.size() / 2) * 11 + letter(word.size() - 1) * 3 + word.size() * 17) % kSlots;
}

/// Open addressing: index into kInfos plus one, 0 where free.
constexpr std::array<uint8_t, kSlots> make_slots() {
  std::array<uint8_t, kSlots> slots{};
  for (size_t i = 0; i < std::size(kInfos); ++i) {
    size_t slot = slot_of(kInfos[i].keyword);
    while (slots[slot] != 0) slot = (slot + 1) % kSlots;
    slots[slot] = static_cast<uint8_t>(i + 1);
  }
  return slots;
}

const DirectiveInfo* find_info(std::string_view keyword) {
  static constexpr std::array<uint8_t, kSlots> kSlotTable = make_slots();
  if (keyword.empty()) return nullptr;
  for (size_t slot = slot_of(keyword); kSlotTable[slot] != 0; slot = (slot + 1) % kSlots)
    if (kInfos[kSlotTable[slot] - 1].keyword == keyword) return &kInfos[kSlotTable[slot] - 1];
  return nullptr;
}

std::string_view closest_directive(std::string_view word) {
  std::vector<std::string_view> keywords;
  for (const DirectiveInfo& info : kInfos) keywords.push_back(info.keyword);
  return closest_name(word, keywords);
}

bool is_directive(const Token& token) { return token.kind == TokenKind::kWord && find_info(token.text) != nullptr; }

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

/// A number, maybe with other characters behind it; a word like "Info" is none, though it begins like one.
bool is_number(const Token& token) {
  if (token.kind != TokenKind::kWord) return false;
  const size_t used = parse_number<double>(token.text).used;
  return used == token.text.size() || (used > 0 && !is_letter(token.text[0]));
}

bool is_numeric(ParameterType type) {
  return type != ParameterType::kString && type != ParameterType::kTexture && type != ParameterType::kBool;
}

/// Appends, converting if need be.
template <class Number>
void append(std::vector<double>& values, std::span<const Number> more) {
  values.insert(values.end(), more.begin(), more.end());
}
template <class Number, class Triplet, class Other>
void append(NumberArray<Number, Triplet>& values, std::span<const Other> more) {
  values.append(more);
}

/// parse_number of a word in the tokenizer's window, which scanners may read beyond.
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

/// Components per value: values come in multiples of it.
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

bool Parser::next(Directive& directive) {
  while (true) {
    const Token& token = source_.peek();
    if (token.kind == TokenKind::kEnd) return false;
    const DirectiveInfo* const info = token.kind == TokenKind::kWord ? find_info(token.text) : nullptr;
    if (!info) {
      const bool number = is_number(token);
      const bool word = token.kind == TokenKind::kWord && !number;
      std::string message = word     ? "unknown directive " + describe(token)
                            : number ? "expected a directive, found the number " + describe(token)
                                     : "expected a directive, found " + describe(token);
      if (word) message += did_you_mean(closest_directive(token.text));
      if (token.kind != TokenKind::kBadByte) reporter_.error(source_.place(), std::move(message));
      const uint32_t line = token.line;
      source_.consume();
      skip_to_directive(line);
      continue;
    }
    reporter_.next_directive();
    directive.kind = info->kind;
    directive.keyword = info->keyword;
    directive.place = source_.place();
    directive.name_count = 0;
    directive.damaged = false;
    directive.parameters.clear();
    source_.consume();
    const uint64_t cut_before = source_.cut_strings();
    const bool readable = read_arguments(*info, directive);
    if (source_.cut_strings() != cut_before) directive.damaged = true;
    if (!readable) {
      skip_to_directive(directive.place.line);
      continue;
    }
    if (info->kind != K::kInclude) return true;
    const std::filesystem::path path = file_names_.resolve(include_name_, directive.place, reporter_);
    if (!path.empty()) source_.include(path, directive.place);
  }
}

bool Parser::read_arguments(const DirectiveInfo& info, Directive& directive) {
  if (info.numbers > 0) return read_directive_numbers(info, directive);
  if (info.kind == K::kActiveTransform) {
    const Token& token = source_.peek();
    if (token.kind != TokenKind::kWord) {
      report_unexpected("All, StartTime or EndTime after ActiveTransform");
      return false;
    }
    directive.names[directive.name_count++] = std::string(token.text);
    source_.consume();
    return true;
  }
  if (!read_directive_names(info, directive)) return false;
  if (info.parameters) read_parameters(directive);
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
      report_unexpected("a quoted name after " + std::string(info.keyword));
      if (token.kind == TokenKind::kWord && !is_directive(token)) source_.consume(); // reported
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

void Parser::report_unexpected(const std::string& expected) {
  const Token& token = source_.peek();
  if (token.kind == TokenKind::kBadByte) return; // reported already
  if (token.kind == TokenKind::kUnterminatedString)
    reporter_.error(source_.place(), "string without its closing quote: " + in_quotes(token.text));
  else
    reporter_.error(source_.place(), "expected " + expected + ", found " + describe(token));
}

/// To what is a directive, or stands where one would and may be meant to be one: a word in front of a line behind line.
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
  if (number.used == 0 || is_directive(token)) return false;
  if (number.used < token.text.size())
    reporter_.warning(source_.place(),
                      "number " + describe(token) + " has other characters after it; they are ignored");
  if constexpr (std::is_same_v<T, int32_t>) {
    if (!(number.value >= std::numeric_limits<int32_t>::min() && number.value <= std::numeric_limits<int32_t>::max()))
      reporter_.warning(source_.place(), "integer " + describe(token) + " does not fit in 32 bits");
    else if (number.value != std::trunc(number.value))
      reporter_.warning(source_.place(), "integer expected, found " + describe(token) + "; the fraction is cut off");
    // Not a number becomes the least integer, which no index or count can be.
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
  do source_.read_numbers<typename Values::value_type>([&](auto numbers) { append(values, numbers); });
  while (take_number(values));
}

void Parser::read_parameters(Directive& directive) {
  while (source_.peek().kind == TokenKind::kString) {
    Parameter& parameter = directive.parameters.append();
    parameter.place = source_.place();
    const bool declared = read_declaration(source_.peek().text, parameter);
    source_.consume();
    if (!declared) skip_value();
    if (declared && read_values(parameter)) {
      cut_excess(parameter);
      directive.parameters.keep();
    } else {
      directive.parameters.drop();
      directive.damaged = true;
    }
  }
  if (source_.peek().kind == TokenKind::kWord || source_.peek().kind == TokenKind::kEnd) return;
  report_unexpected("a parameter or a directive");
  directive.damaged = true;
  const uint32_t line = source_.place().line;
  source_.consume();
  skip_to_directive(line);
}

bool Parser::read_declaration(std::string_view text, Parameter& parameter) {
  const auto is_gap = [](char c) { return c == ' ' || c == '\t'; };
  const auto* p = text.begin();
  const auto word = [&] {
    p = std::find_if_not(p, text.end(), is_gap);
    const auto* const start = p;
    p = std::find_if(p, text.end(), is_gap);
    return std::string_view(start, p);
  };
  const std::string_view type_name = word();
  const std::string_view name = word();
  const std::string_view more = word();
  const std::optional<ParameterType> type = parameter_type(type_name);
  if (type && !name.empty()) {
    parameter.type = *type;
    parameter.name = std::string(name);
    if (!more.empty())
      reporter_.warning(parameter.place, in_quotes(text) + " has more than a type and a name; the rest is ignored");
    return true;
  }
  if (!type && !name.empty())
    reporter_.error(parameter.place, "unknown parameter type " + in_quotes(type_name) + " in " + in_quotes(text) +
                                             did_you_mean(closest_parameter_type(type_name)));
  else
    reporter_.error(parameter.place, "a parameter is declared as \"type name\", found " + in_quotes(text));
  return false;
}

/// Skips what could be the value of a parameter that was not understood.
void Parser::skip_value() {
  const TokenKind kind = source_.peek().kind;
  if (kind == TokenKind::kOpen) {
    while (source_.peek().kind != TokenKind::kClose && source_.peek().kind != TokenKind::kEnd &&
           !is_directive(source_.peek()))
      source_.consume();
    if (source_.peek().kind == TokenKind::kClose) source_.consume();
  } else if (kind == TokenKind::kString || (kind == TokenKind::kWord && !is_directive(source_.peek()))) {
    source_.consume();
  }
}

bool Parser::read_values(Parameter& parameter) {
  return source_.peek().kind == TokenKind::kOpen ? read_array(parameter) : read_single(parameter);
}

bool Parser::read_single(Parameter& parameter) {
  const bool taken = parameter.type == ParameterType::kInteger ? take_number(parameter.integers)
                     : parameter.type == ParameterType::kBool  ? take_bool(parameter)
                     : is_numeric(parameter.type)              ? take_number(parameter.floats) || take_string(parameter)
                                                               : take_string(parameter);
  if (!taken) {
    report_unexpected("a value for parameter " + in_quotes(parameter.name));
    if (!is_directive(source_.peek()) && source_.peek().kind != TokenKind::kEnd) source_.consume();
  }
  return taken;
}

bool Parser::read_array(Parameter& parameter) {
  const Place open = source_.place();
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
    if (token.kind == TokenKind::kEnd || is_directive(token)) {
      reporter_.error(open, "\"[\" without its \"]\": the values of parameter " + in_quotes(parameter.name) +
                                " run into " + describe(token));
      return false;
    }
    if (parameter.type == ParameterType::kBool ? take_bool(parameter) : take_string(parameter)) continue;
    report_unexpected(std::string(is_numeric(parameter.type) ? "a number" : "a string") + " or \"]\" in parameter " +
                      in_quotes(parameter.name));
    while (source_.peek().kind != TokenKind::kClose && source_.peek().kind != TokenKind::kEnd &&
           !is_directive(source_.peek()))
      source_.consume();
    if (source_.peek().kind == TokenKind::kClose) source_.consume();
    return false;
  }
}

bool Parser::take_string(Parameter& parameter) {
  const Token& token = source_.peek();
  if (token.kind != TokenKind::kString) return false;
  if (is_numeric(parameter.type) && parameter.type != ParameterType::kSpectrum) return false;
  parameter.strings.emplace_back(token.text);
  source_.consume();
  return true;
}

bool Parser::take_bool(Parameter& parameter) {
  const Token& token = source_.peek();
  if (token.kind != TokenKind::kString && token.kind != TokenKind::kWord) return false;
  if (token.text != "true" && token.text != "false") {
    if (token.kind == TokenKind::kWord) return false;
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
