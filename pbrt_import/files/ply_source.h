#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/ply_header.h"
#include "pbrt_import/text/number.h"
#include "pbrt_import/text/tokenizer.h"

/// Readers for the values of a PLY body. BinarySource and AsciiSource have the same members, so that element readers
/// can be templates over them.
namespace packtrace::ply {

static_assert(std::endian::native == std::endian::little);

template <class T>
T byte_swapped(T value) {
  auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
  std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

template <class T, bool kSwap>
T load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return kSwap ? byte_swapped(value) : value;
}

/// Calls visitor.template operator()<T>() with the C++ type of a PLY type.
template <class Visitor>
auto visit_type(PlyType type, Visitor&& visitor) {
  switch (type) {
  case PlyType::kInt8:
    return visitor.template operator()<int8_t>();
  case PlyType::kUint8:
    return visitor.template operator()<uint8_t>();
  case PlyType::kInt16:
    return visitor.template operator()<int16_t>();
  case PlyType::kUint16:
    return visitor.template operator()<uint16_t>();
  case PlyType::kInt32:
    return visitor.template operator()<int32_t>();
  case PlyType::kUint32:
    return visitor.template operator()<uint32_t>();
  case PlyType::kFloat32:
    return visitor.template operator()<float>();
  case PlyType::kFloat64:
    break;
  }
  return visitor.template operator()<double>();
}

/// Current read position in the body, for messages.
struct Position {
  const PlyElement* element = nullptr;
  uint64_t row = 0;
};

[[noreturn]] inline void fail_at(const Position& at, const std::string& problem) {
  throw Error(ErrorKind::kInput, problem + " (in element " + in_quotes(at.element->name) + ", row " +
                                     std::to_string(at.row) + " of " + std::to_string(at.element->count) + ")");
}

/// Reads the values of a binary body one by one.
template <bool kSwap>
class BinarySource {
public:
  static constexpr bool kBinary = true;
  explicit BinarySource(std::span<const std::byte> body) : next_(body.data()), end_(body.data() + body.size()) {}

  uint64_t remaining() const { return static_cast<uint64_t>(end_ - next_); }
  uint64_t min_row_size(const PlyElement& element) const { return element.fixed_row_bytes(); }
  uint64_t min_item_size(PlyType type) const { return byte_size(type); }

  double number(PlyType type) {
    const std::byte* const from = take(byte_size(type));
    return visit_type(type, [&]<class T>() { return static_cast<double>(load<T, kSwap>(from)); });
  }
  float real(PlyType type) { return static_cast<float>(number(type)); }
  void skip(PlyType type, uint64_t count) { take(byte_size(type) * count); } // no overflow, since count <= remaining()

  /// Consumes and returns the next `size` bytes. Throws Error(kInput) if the body is shorter.
  const std::byte* take(uint64_t size) {
    if (size > remaining()) fail_at(at, "the file is truncated");
    const std::byte* const from = next_;
    next_ += size;
    return from;
  }

  Position at;

private:
  const std::byte* next_;
  const std::byte* end_;
};

/// Reads the words of an ASCII body. Line ends count as blanks, as in common PLY readers.
class AsciiSource {
public:
  static constexpr bool kBinary = false;
  explicit AsciiSource(std::span<const std::byte> bytes, size_t body_offset)
      : begin_(reinterpret_cast<const char*>(bytes.data())), next_(begin_ + body_offset), end_(begin_ + bytes.size()) {}

  // One more than the bytes left, since the last word needs no blank after it.
  uint64_t remaining() const { return static_cast<uint64_t>(end_ - next_) + 1; }
  uint64_t min_row_size(const PlyElement& element) const { return 2 * uint64_t{element.properties.size()}; }
  uint64_t min_item_size(PlyType) const { return 2; }

  double number(PlyType type) {
    skip_blanks();
    int32_t integer = 0;
    if (type < PlyType::kFloat32 && can_scan()) {
      if (const char* const after = scan_integer(next_, integer)) {
        next_ = after;
        return integer;
      }
    }
    return parse<double>();
  }
  float real(PlyType) {
    skip_blanks();
    float value = 0.0f;
    if (can_scan()) {
      if (const char* const after = scan_float(next_, value)) {
        next_ = after;
        return value;
      }
    }
    return parse<float>();
  }
  void skip(PlyType type, uint64_t count) {
    for (uint64_t i = 0; i < count; ++i) number(type);
  }

  Position at;

private:
  static bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
  bool can_scan() const { return static_cast<size_t>(end_ - next_) >= kScannerReach; }
  void skip_blanks() {
    while (next_ != end_ && is_blank(*next_)) ++next_;
  }

  template <class T>
  T parse() {
    const char* const word_end = std::find_if(next_, end_, is_blank);
    const std::string_view word(next_, static_cast<size_t>(word_end - next_));
    if (word.empty()) fail_at(at, "the file is truncated");
    const NumberText<T> result = parse_number<T>(word);
    if (result.used != word.size()) {
      const auto line = std::count(begin_, next_, '\n') + 1;
      fail_at(at, "line " + std::to_string(line) + ": expected a number, found " + in_quotes(word));
    }
    next_ = word_end;
    return result.value;
  }

  const char* begin_;
  const char* next_;
  const char* end_;
};

} // namespace packtrace::ply
