#include "runtime/motion/json_tree.h"

#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include <nlohmann/json.hpp>

#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/with_file.h"

namespace packtrace {
namespace {

/// Counts the characters that the parser has consumed, because the parser does not report positions.
struct TextPlace {
  uint32_t line = 1, column = 1;             // of the next character
  uint32_t token_line = 1, token_column = 1; // begin of the last value, name or bracket that opens
  uint32_t last_line = 1, last_column = 1;   // of the last character
  bool in_string = false, escaped = false, in_token = false;

  void take(char c) {
    last_line = line, last_column = column;
    if (in_string) {
      if (escaped)
        escaped = false;
      else if (c == '\\')
        escaped = true;
      else if (c == '"')
        in_string = in_token = false;
    } else if (c == '"' || c == '{' || c == '[') {
      begin();
      in_string = c == '"', in_token = false;
    } else if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == ':' || c == '}' || c == ']') {
      in_token = false;
    } else if (!in_token) {
      begin();
      in_token = true;
    }
    if (c == '\n')
      ++line, column = 1;
    else
      ++column;
  }

private:
  void begin() { token_line = line, token_column = column; }
};

/// Iterates over a file's characters and keeps a place up to date.
class PlacedText {
public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  PlacedText(const char* at, TextPlace* place) : at_(at), place_(place) {}
  reference operator*() const { return *at_; }
  PlacedText& operator++() {
    place_->take(*at_++);
    return *this;
  }
  PlacedText operator++(int) {
    PlacedText before = *this;
    ++*this;
    return before;
  }
  bool operator==(const PlacedText& other) const { return at_ == other.at_; }

private:
  const char* at_;
  TextPlace* place_;
};

} // namespace

/// Receives the parser's events.
class JsonTreeBuilder {
public:
  JsonTreeBuilder(JsonTree& tree, const TextPlace& place) : tree_(tree), place_(place) {}

  bool null() { return add(JsonValue::Type::kNull), true; }
  bool boolean(bool value) { return add(JsonValue::Type::kBool).flag = value, true; }
  bool number_integer(int64_t value) { return number(static_cast<double>(value)); }
  bool number_unsigned(uint64_t value) { return number(static_cast<double>(value)); }
  bool number_float(double value, const std::string&) { return number(value); }
  bool string(std::string& value) {
    const uint32_t text = keep(value);
    add(JsonValue::Type::kString).text = text;
    return true;
  }
  bool binary(std::vector<uint8_t>&) { return false; }
  bool start_object(size_t) { return open(JsonValue::Type::kObject); }
  bool start_array(size_t) { return open(JsonValue::Type::kArray); }
  bool end_object() { return open_.pop_back(), true; }
  bool end_array() { return open_.pop_back(), true; }

  bool key(std::string& name) {
    const JsonValue& parent = tree_.values_[open_.back().value];
    if (++open_.back().members > kMaxMembers) fail_here("an object with more than 64 members");
    tree_.for_each(parent, [&](const JsonValue& member) {
      if (tree_.strings_[member.name] == name) fail_here("\"" + name + "\" is given twice");
    });
    name_ = keep(name);
    return true;
  }

  bool parse_error(size_t, const std::string&, const nlohmann::json::exception& error) {
    // The library's text begins with its own code and place: "[json.exception...] parse error at line 1, column 2: ".
    std::string what = error.what();
    if (const size_t end = what.find("] "); end != std::string::npos) what.erase(0, end + 2);
    if (const size_t end = what.find(": "); what.starts_with("parse error at") && end != std::string::npos)
      what.erase(0, end + 2);
    constexpr int kOutOfRange = 406; // a number, whose place is its begin
    if (error.id == kOutOfRange) fail_here(what);
    fail_at(place_.last_line, place_.last_column, what);
  }

private:
  static constexpr uint32_t kMaxMembers = 64;
  struct Open {
    uint32_t value = 0, last = JsonValue::kNone, members = 0;
  };

  [[noreturn]] void fail_here(const std::string& problem) const {
    fail_at(place_.token_line, place_.token_column, problem);
  }

  [[noreturn]] void fail_at(uint32_t line, uint32_t column, const std::string& problem) const {
    JsonValue here;
    here.line = line, here.column = column;
    tree_.fail(here, problem);
  }

  uint32_t keep(std::string& text) {
    tree_.strings_.push_back(std::move(text));
    return static_cast<uint32_t>(tree_.strings_.size() - 1);
  }

  bool number(double value) { return add(JsonValue::Type::kNumber).number = value, true; }

  JsonValue& add(JsonValue::Type type) {
    const auto index = static_cast<uint32_t>(tree_.values_.size());
    if (!open_.empty()) {
      Open& parent = open_.back();
      (parent.last == JsonValue::kNone ? tree_.values_[parent.value].first : tree_.values_[parent.last].next) = index;
      parent.last = index;
    }
    JsonValue& value = tree_.values_.emplace_back();
    value.type = type;
    value.line = place_.token_line, value.column = place_.token_column;
    value.name = std::exchange(name_, JsonValue::kNone);
    return value;
  }

  bool open(JsonValue::Type type) {
    add(type);
    open_.push_back({static_cast<uint32_t>(tree_.values_.size() - 1)});
    return true;
  }

  JsonTree& tree_;
  const TextPlace& place_;
  std::vector<Open> open_;
  uint32_t name_ = JsonValue::kNone;
};

JsonTree::JsonTree(const std::filesystem::path& file, const MemoryBudget& budget) : memory_(budget) {
  file_.file = std::make_shared<const SourceFile>(SourceFile{file.string(), {}});
  // The shortest values are two characters, and vectors grow by doubling.
  constexpr uint64_t kBytesPerCharacter = 3 * sizeof(JsonValue) / 2 + 3 * sizeof(std::string) / 2;
  constexpr uint64_t kMaxBytes = uint64_t{1} << 31; // numbers of values have 32 bits
  std::error_code unknown;                          // reading the file reports the error
  const uint64_t size = std::filesystem::file_size(file, unknown);
  if (!unknown && size > kMaxBytes) throw FileError(ErrorKind::kInput, file, "a file of keys of more than 2 GiB");
  with_file(file, [&] { memory_.resize(unknown ? 0 : size * kBytesPerCharacter, "reading keys"); });
  const std::vector<std::byte> bytes = read_file_bytes(file, unknown ? 0 : size);
  TextPlace place;
  JsonTreeBuilder builder(*this, place);
  const char* const text = reinterpret_cast<const char*>(bytes.data());
  nlohmann::json::sax_parse(PlacedText(text, &place), PlacedText(text + bytes.size(), &place), &builder);
}

void JsonTree::fail(const JsonValue& value, const std::string& problem) const {
  SourceLocation place = file_;
  place.line = value.line, place.column = value.column;
  throw FileError(ErrorKind::kInput, place, problem);
}

} // namespace packtrace
