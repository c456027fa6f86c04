#include "pbrt_import/mesh_files/directive_feed.h"

#include <algorithm>
#include <array>

#include "pbrt_import/text/problem_text.h"

namespace packtrace {
namespace {

/// The text of a string literal with this value.
std::string escape(std::string_view value) {
  std::string escaped;
  for (const char c : value) {
    if (c == '\\' || c == '"') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

} // namespace

void DirectiveFeed::begin(std::string_view keyword, const Place& place, std::initializer_list<std::string_view> names,
                          std::span<const double> numbers) {
  reporter_.next_directive();
  directive_.kind = find_directive(keyword)->kind;
  directive_.keyword = keyword;
  directive_.place = place;
  directive_.parameters.clear();
  directive_.memory = MemoryReservation(memory_);
  directive_.name_count = 0;
  directive_.motion = {};
  directive_.sequence = kNoSequence;
  for (const std::string_view name : names) directive_.names[directive_.name_count++] = name;
  std::ranges::copy(numbers, directive_.numbers.begin());
}

Parameter& DirectiveFeed::add(ParameterType type, std::string_view name) {
  Parameter& parameter = directive_.parameters.append();
  parameter.type = type;
  parameter.name = name;
  parameter.place = directive_.place;
  return parameter;
}

void DirectiveFeed::reserve(uint64_t bytes) {
  with_place(
      reporter_, [&] { return directive_.place; },
      [&] { directive_.memory.resize(directive_.memory.bytes() + bytes, "the shape"); });
}

void DirectiveFeed::floats(ParameterType type, std::string_view name, std::span<const float> values) {
  reserve(values.size_bytes());
  add(type, name).floats = FloatArray(values);
  directive_.parameters.keep();
}

void DirectiveFeed::integers(std::string_view name, std::span<const int32_t> values) {
  reserve(values.size_bytes());
  add(ParameterType::kInteger, name).integers = IntegerArray(values);
  directive_.parameters.keep();
}

void DirectiveFeed::flag(std::string_view name, bool value) {
  add(ParameterType::kBool, name).integers.push_back(value ? 1 : 0);
  directive_.parameters.keep();
}

void DirectiveFeed::text(std::string_view name, std::string_view value) {
  add(ParameterType::kString, name).strings.push_back(escape(value));
  directive_.parameters.keep();
}

void DirectiveFeed::texture(std::string_view name, std::string_view texture) {
  add(ParameterType::kTexture, name).strings.push_back(escape(texture));
  directive_.parameters.keep();
}

void DirectiveFeed::transform(std::string_view keyword, const Place& place, const DAffine& map) {
  std::array<double, 16> columns{};
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 3; ++r) columns[static_cast<size_t>(4 * c + r)] = map[c][r];
  columns[15] = 1.0;
  begin(keyword, place, {}, columns);
  send();
}

void DirectiveFeed::send() {
  with_place(reporter_, [&] { return directive_.place; }, [&] { builder_.handle(directive_); });
}

} // namespace packtrace
