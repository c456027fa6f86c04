#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// A value of a JSON file with its place.
struct JsonValue {
  enum class Type : uint8_t { kNull, kBool, kNumber, kString, kArray, kObject };
  static constexpr uint32_t kNone = ~0u;

  Type type = Type::kNull;
  bool flag = false;
  uint32_t line = 0, column = 0; ///< from 1
  uint32_t first = kNone;        ///< first element or member
  uint32_t next = kNone;         ///< next element or member of the parent
  uint32_t text = kNone;         ///< number of a string: the value's
  uint32_t name = kNone;         ///< number of a string: the member's name
  double number = 0.0;
};

/// A JSON file that keeps the line and column of each value for messages.
class JsonTree {
public:
  /// Reserves memory in proportion to the file's size before it is read. Throws MemoryError, and Error(kInput) with
  /// file:line:column for syntax errors, repeated names in an object, numbers out of range, and missing files.
  JsonTree(const std::filesystem::path& file, const MemoryBudget& budget);

  const JsonValue& root() const { return values_.front(); }
  const JsonValue& at(uint32_t value) const { return values_[value]; }
  const std::string& text(uint32_t string) const { return strings_[string]; }

  /// Calls visit(const JsonValue&) for each element or member.
  template <typename Visit>
  void for_each(const JsonValue& parent, const Visit& visit) const {
    for (uint32_t i = parent.first; i != JsonValue::kNone; i = values_[i].next) visit(values_[i]);
  }

  /// Throws Error(kInput), "file:line:column: problem".
  [[noreturn]] void fail(const JsonValue& value, const std::string& problem) const;

private:
  friend class JsonTreeBuilder;

  SourceLocation file_;
  MemoryReservation memory_;
  std::vector<JsonValue> values_;
  std::vector<std::string> strings_;
};

} // namespace packtrace
