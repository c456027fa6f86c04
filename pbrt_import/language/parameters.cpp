#include "pbrt_import/language/parameters.h"

#include <algorithm>
#include <array>
#include <utility>

#include "pbrt_import/base/equal_text.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

constexpr std::pair<std::string_view, ParameterType> kTypeNames[] = {
    {"integer", ParameterType::kInteger},
    {"float", ParameterType::kFloat},
    {"bool", ParameterType::kBool},
    {"string", ParameterType::kString},
    {"texture", ParameterType::kTexture},
    {"point2", ParameterType::kPoint2},
    {"vector2", ParameterType::kVector2},
    {"point", ParameterType::kPoint3},
    {"vector", ParameterType::kVector3},
    {"normal", ParameterType::kNormal},
    {"rgb", ParameterType::kRgb},
    {"xyz", ParameterType::kXyz},
    {"blackbody", ParameterType::kBlackbody},
    {"spectrum", ParameterType::kSpectrum},
    {"point3", ParameterType::kPoint3},
    {"vector3", ParameterType::kVector3},
    {"color", ParameterType::kRgb},
    {"normal3", ParameterType::kNormal},
};

const Parameter* single_value(const ParameterList& list, std::string_view name, ParameterType type, size_t values) {
  const Parameter* const parameter = list.find(name, {type});
  if (!parameter) return nullptr;
  const size_t count = parameter->floats.size() + parameter->integers.size() + parameter->strings.size();
  if (count == values) return parameter;
  parameter->used = false; // so that it is reported as unused, as in pbrt
  return nullptr;
}

} // namespace

std::optional<ParameterType> parameter_type(std::string_view name) {
  for (const auto& [text, type] : kTypeNames)
    if (text == name) return type;
  return std::nullopt;
}

std::string_view to_string(ParameterType type) {
  for (const auto& [text, candidate] : kTypeNames)
    if (candidate == type) return text;
  return "unknown";
}

std::string_view closest_parameter_type(std::string_view name) {
  std::array<std::string_view, std::size(kTypeNames)> names;
  std::transform(std::begin(kTypeNames), std::end(kTypeNames), names.begin(),
                 [](const auto& entry) { return entry.first; });
  return closest_name(name, names);
}

std::string describe(const Parameter& parameter) {
  return in_quotes(std::string(to_string(parameter.type)) + ' ' + parameter.name);
}

const Parameter* ParameterList::keep() {
  constexpr size_t kLinearSearch = 32;
  Parameter& last = this->last();
  types_ |= bit_of(last.type);
  Parameter* same = nullptr;
  if (count_ <= kLinearSearch + 1) {
    for (Parameter& existing : std::span(parameters_).first(count_ - 1))
      if (existing.type == last.type && equal_text(existing.name, last.name)) same = &existing;
  } else { // only hostile scenes have so many parameters
    const auto key = [](const Parameter& parameter) { return static_cast<char>(parameter.type) + parameter.name; };
    if (index_.empty())
      for (size_t i = 0; i + 1 < count_; ++i) index_.emplace(key(parameters_[i]), i);
    const auto [found, inserted] = index_.try_emplace(key(last), count_ - 1);
    if (!inserted) same = &parameters_[found->second];
  }
  if (!same) return nullptr;
  std::swap(*same, last);
  drop();
  return same;
}

const Parameter* ParameterList::find_type_in(uint32_t type_bits, std::string_view name) const {
  looked_up_.push_back(name);
  if ((types_ & type_bits) == 0) return nullptr;
  for (size_t i = count_; i-- > 0;) {
    const Parameter& parameter = parameters_[i];
    if ((type_bits & bit_of(parameter.type)) == 0 || !equal_text(parameter.name, name)) continue;
    parameter.used = true;
    return &parameter;
  }
  return nullptr;
}

const Parameter* ParameterList::peek(std::string_view name, ParameterType type) const {
  if ((types_ & bit_of(type)) == 0) return nullptr;
  for (const Parameter& parameter : all())
    if (parameter.type == type && equal_text(parameter.name, name)) return &parameter;
  return nullptr;
}

float ParameterList::get_float(std::string_view name, float fallback) const {
  const Parameter* const found = single_value(*this, name, ParameterType::kFloat, 1);
  return found ? found->floats[0] : fallback;
}

int32_t ParameterList::get_integer(std::string_view name, int32_t fallback) const {
  const Parameter* const found = single_value(*this, name, ParameterType::kInteger, 1);
  return found ? found->integers[0] : fallback;
}

bool ParameterList::get_bool(std::string_view name, bool fallback) const {
  const Parameter* const found = single_value(*this, name, ParameterType::kBool, 1);
  return found ? found->integers[0] != 0 : fallback;
}

std::string ParameterList::get_string(std::string_view name, std::string_view fallback) const {
  const Parameter* const found = single_value(*this, name, ParameterType::kString, 1);
  bool unknown_escape = false;
  return found ? unescape(found->strings[0], unknown_escape) : std::string(fallback);
}

Vec3 ParameterList::get_point(std::string_view name, Vec3 fallback) const {
  const Parameter* const found = single_value(*this, name, ParameterType::kPoint3, 3);
  return found ? Vec3(found->floats[0], found->floats[1], found->floats[2]) : fallback;
}

std::span<const float> ParameterList::floats(std::string_view name, ParameterType type) const {
  const Parameter* const found = find(name, {type});
  return found ? std::span<const float>(found->floats) : std::span<const float>();
}

std::span<const int32_t> ParameterList::integers(std::string_view name) const {
  const Parameter* const found = find(name, {ParameterType::kInteger});
  return found ? std::span<const int32_t>(found->integers) : std::span<const int32_t>();
}

std::vector<Vec3> ParameterList::take_vectors(std::string_view name, ParameterType type) {
  const Parameter* const found = find(name, {type});
  if (!found) return {};
  return parameters_[static_cast<size_t>(found - parameters_.data())].floats.take_triplets();
}

std::vector<Triangle> ParameterList::take_triangles(std::string_view name) {
  const Parameter* const found = find(name, {ParameterType::kInteger});
  if (!found) return {};
  return parameters_[static_cast<size_t>(found - parameters_.data())].integers.take_triplets();
}

void ParameterList::mark_used(std::span<const std::string_view> names) const {
  looked_up_.insert(looked_up_.end(), names.begin(), names.end());
  for (const Parameter& parameter : all())
    for (const std::string_view name : names) parameter.used = parameter.used || equal_text(parameter.name, name);
}

bool ParameterList::was_looked_up(std::string_view name) const {
  return std::find(looked_up_.begin(), looked_up_.end(), name) != looked_up_.end();
}

std::string_view ParameterList::suggestion(std::string_view name) const { return closest_name(name, looked_up_); }

std::string did_you_mean(std::string_view suggestion) {
  return did_you_mean_text(suggestion.empty() ? std::string() : in_quotes(suggestion));
}

} // namespace packtrace
