#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"

/// Access to the values of a glTF document that checks them: a value of the wrong kind throws Error(kInput) with its
/// path, such as "meshes[3].primitives[0].mode".
namespace packtrace::gltf {

/// A value with its path in the document.
class Value {
public:
  Value(const nlohmann::json& json, std::string path) : json_(&json), path_(std::move(path)) {}

  const std::string& path() const { return path_; }
  bool has(const char* key) const { return json_->is_object() && json_->contains(key); }
  /// Member of an object; none if it is absent. Throws if this is not an object.
  std::optional<Value> find(const char* key) const;
  /// Member that must exist.
  Value at(const char* key) const;
  /// Extension of this object; none if it is absent.
  std::optional<Value> extension(const char* name) const;

  /// Size of an array. Throws if this is not an array.
  size_t size() const;
  /// Element of an array; throws if there is none.
  Value operator[](size_t i) const;
  /// Names of an object's members, sorted.
  std::vector<std::string> names() const;

  uint64_t integer() const;        ///< a whole number, not negative
  double number() const;           ///< finite
  const std::string& text() const; ///< lives as long as the JSON value
  bool flag() const;
  /// Numbers of an array of this size.
  std::vector<double> numbers(size_t size) const;

  std::optional<uint64_t> find_integer(const char* key) const;
  double number_or(const char* key, double fallback) const;
  std::string text_or(const char* key, std::string fallback) const;
  std::vector<double> numbers_or(const char* key, std::vector<double> fallback) const;

  [[noreturn]] void fail(const std::string& problem) const;

private:
  const nlohmann::json* json_;
  std::string path_;
};

} // namespace packtrace::gltf
