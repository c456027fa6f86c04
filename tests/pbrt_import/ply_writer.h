#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/ply.h"

/// Writes and reads small PLY files in memory.
namespace packtrace::ply_test {

struct Reports {
  std::vector<std::string> messages;
  ReportFn fn() {
    return [this](Severity, uint32_t, std::string message) { messages.push_back(std::move(message)); };
  }
};

inline PlyMesh read(const std::string& text, Reports* reports = nullptr) {
  return read_ply(std::as_bytes(std::span(text)), reports ? reports->fn() : ReportFn());
}

/// Message of the Error that reading throws; "" if there is none.
inline std::string error_of(const std::string& text) {
  try {
    read(text);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return "";
}

enum class Format { kAscii, kLittle, kBig };
inline constexpr Format kFormats[] = {Format::kAscii, Format::kLittle, Format::kBig};

/// Writes PLY files value by value, in the types of the header.
class Writer {
public:
  explicit Writer(Format format) : format_(format) {
    constexpr const char* kNames[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    text_ = "ply\nformat " + std::string(kNames[static_cast<int>(format)]) + " 1.0\n";
  }
  Writer& line(const std::string& line) {
    text_ += line + "\n";
    return *this;
  }
  Writer& put(const std::string& type, double value) {
    if (format_ == Format::kAscii) {
      char buffer[64];
      std::snprintf(buffer, sizeof buffer, "%.17g ", value);
      text_ += buffer;
    } else if (type == "char" || type == "int8") {
      bytes(static_cast<int8_t>(value));
    } else if (type == "uchar" || type == "uint8") {
      bytes(static_cast<uint8_t>(value));
    } else if (type == "short" || type == "int16") {
      bytes(static_cast<int16_t>(value));
    } else if (type == "ushort" || type == "uint16") {
      bytes(static_cast<uint16_t>(value));
    } else if (type == "int" || type == "int32") {
      bytes(static_cast<int32_t>(value));
    } else if (type == "uint" || type == "uint32") {
      bytes(static_cast<uint32_t>(value));
    } else if (type == "float" || type == "float32") {
      bytes(static_cast<float>(value));
    } else {
      bytes(value);
    }
    return *this;
  }
  Writer& row(const std::string& type, std::initializer_list<double> values) {
    for (const double value : values) put(type, value);
    return *this;
  }
  Writer& list(const std::string& length_type, const std::string& type, std::initializer_list<double> values) {
    put(length_type, static_cast<double>(values.size()));
    return row(type, values);
  }
  const std::string& text() const { return text_; }

private:
  template <class T>
  void bytes(T value) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (format_ == Format::kBig) std::reverse(raw.begin(), raw.end());
    text_.append(raw.data(), raw.size());
  }
  Format format_;
  std::string text_;
};

/// A square of two triangles with normals and uvs.
inline std::string square(Format format, const std::string& real = "float", const std::string& length = "uchar",
                          const std::string& index = "int") {
  Writer writer(format);
  writer.line("element vertex 4");
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "u", "v"}) writer.line("property " + real + " " + name);
  writer.line("element face 2").line("property list " + length + " " + index + " vertex_indices").line("end_header");
  writer.row(real, {0, 0, 5, 0, 0, 1, 0, 0}).row(real, {1, 0, 5, 0, 0, 1, 1, 0});
  writer.row(real, {1, 1, 5, 0, 0, 1, 1, 1}).row(real, {0, 1, 5, 0, 0, 1, 0, 1});
  writer.list(length, index, {0, 1, 2}).list(length, index, {0, 2, 3});
  return writer.text();
}

/// Eight vertices with their numbers in x, and lists of strips.
inline std::string strips(Format format, const std::string& index,
                          std::initializer_list<std::initializer_list<double>> lists) {
  Writer writer(format);
  writer.line("element vertex 8").line("property float x").line("property float y").line("property float z");
  writer.line("element tristrips " + std::to_string(lists.size()));
  writer.line("property list int " + index + " vertex_indices").line("end_header");
  for (int i = 0; i < 8; ++i) writer.row("float", {double(i), double(i % 2), 0});
  for (const auto& list : lists) writer.list("int", index, list);
  return writer.text();
}

} // namespace packtrace::ply_test
