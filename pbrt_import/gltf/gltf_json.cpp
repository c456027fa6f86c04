#include "pbrt_import/gltf/gltf_json.h"

#include <cmath>

namespace packtrace::gltf {

void Value::fail(const std::string& problem) const {
  throw Error(ErrorKind::kInput, (path_.empty() ? "the document" : path_) + " " + problem);
}

std::optional<Value> Value::find(const char* key) const {
  if (!json_->is_object()) fail("is not an object");
  const auto found = json_->find(key);
  if (found == json_->end()) return std::nullopt;
  return Value(*found, path_.empty() ? key : path_ + "." + key);
}

Value Value::at(const char* key) const {
  std::optional<Value> found = find(key);
  if (!found) fail("lacks " + std::string(key));
  return std::move(*found);
}

std::optional<Value> Value::extension(const char* name) const {
  const std::optional<Value> extensions = find("extensions");
  return extensions ? extensions->find(name) : std::nullopt;
}

size_t Value::size() const {
  if (!json_->is_array()) fail("is not an array");
  return json_->size();
}

Value Value::operator[](size_t i) const {
  if (i >= size()) fail("has " + std::to_string(size()) + " elements, no element " + std::to_string(i));
  return Value((*json_)[i], path_ + "[" + std::to_string(i) + "]");
}

std::vector<std::string> Value::names() const {
  std::vector<std::string> names;
  for (const auto& [name, value] : json_->items()) names.push_back(name);
  return names;
}

uint64_t Value::integer() const {
  if (json_->is_number_unsigned()) return json_->get<uint64_t>();
  if (json_->is_number_float()) { // some exporters write 3.0
    const double value = json_->get<double>();
    if (value >= 0.0 && value <= 0x1p53 && value == std::floor(value)) return static_cast<uint64_t>(value);
  }
  fail("is not a whole number");
}

double Value::number() const {
  if (!json_->is_number()) fail("is not a number");
  const double value = json_->get<double>();
  if (!std::isfinite(value)) fail("is not finite");
  return value;
}

const std::string& Value::text() const {
  if (!json_->is_string()) fail("is not a string");
  return json_->get_ref<const std::string&>();
}

bool Value::flag() const {
  if (!json_->is_boolean()) fail("is not true or false");
  return json_->get<bool>();
}

std::vector<double> Value::numbers(size_t count) const {
  if (size() != count) fail("does not have " + std::to_string(count) + " numbers");
  std::vector<double> numbers(count);
  for (size_t i = 0; i < count; ++i) {
    const nlohmann::json& value = (*json_)[i];
    const bool sound = value.is_number() && std::isfinite(value.get<double>());
    numbers[i] = sound ? value.get<double>() : (*this)[i].number(); // which throws
  }
  return numbers;
}

std::optional<uint64_t> Value::find_integer(const char* key) const {
  const std::optional<Value> found = find(key);
  return found ? std::optional(found->integer()) : std::nullopt;
}

double Value::number_or(const char* key, double fallback) const {
  const std::optional<Value> found = find(key);
  return found ? found->number() : fallback;
}

std::string Value::text_or(const char* key, std::string fallback) const {
  const std::optional<Value> found = find(key);
  if (found) return found->text();
  return fallback;
}

std::vector<double> Value::numbers_or(const char* key, std::vector<double> fallback) const {
  const std::optional<Value> found = find(key);
  return found ? found->numbers(fallback.size()) : std::move(fallback);
}

} // namespace packtrace::gltf
