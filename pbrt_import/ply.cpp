#include "pbrt_import/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "pbrt_import/number.h"
#include "pbrt_import/ply_header.h"
#include "pbrt_import/scene/error.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/tokenizer.h"

namespace packtrace {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr uint32_t kBadIndex = ~0u;                  // out of range for every mesh: dropped and counted with the others
constexpr uint64_t kMaxVertices = uint64_t{1} << 31; // so that negative indices are out of range once unsigned

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

/// Where the body is being read, and for messages, what.
struct Position {
  const PlyElement* element = nullptr;
  uint64_t row = 0;
};

[[noreturn]] void fail_at(const Position& at, const std::string& problem) {
  throw Error(ErrorKind::kInput, problem + " (in element " + in_quotes(at.element->name) + ", row " +
                                     std::to_string(at.row) + " of " + std::to_string(at.element->count) + ")");
}

/// The values of a binary body, one by one.
template <bool kSwap>
class BinarySource {
public:
  static constexpr bool kBinary = true;
  static constexpr bool kSwapped = kSwap;
  explicit BinarySource(std::span<const std::byte> body) : next_(body.data()), end_(body.data() + body.size()) {}

  uint64_t remaining() const { return static_cast<uint64_t>(end_ - next_); }
  uint64_t min_row_size(const PlyElement& element) const { return element.fixed_row_bytes(); }
  uint64_t min_item_size(PlyType type) const { return byte_size(type); }

  double number(PlyType type) {
    const std::byte* const from = take(byte_size(type));
    return visit_type(type, [&]<class T>() { return static_cast<double>(load<T, kSwap>(from)); });
  }
  float real(PlyType type) { return static_cast<float>(number(type)); }
  void skip(PlyType type, uint64_t count) { take(byte_size(type) * count); } // count <= remaining(): no overflow

  /// The next size bytes, which are then behind.
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

/// The words of an ASCII body. Line ends mean nothing more than blanks, as in the usual readers.
class AsciiSource {
public:
  static constexpr bool kBinary = false;
  explicit AsciiSource(std::span<const std::byte> bytes, size_t body_offset)
      : begin_(reinterpret_cast<const char*>(bytes.data())), next_(begin_ + body_offset), end_(begin_ + bytes.size()) {}

  uint64_t remaining() const { return static_cast<uint64_t>(end_ - next_) + 1; } // the last word needs no blank
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

/// Throws if the file is too short for the rows an element claims, so that allocating them is safe.
template <class Source>
void check_row_count(Source& source, const PlyElement& element) {
  source.at = {&element, 0};
  const uint64_t row_size = source.min_row_size(element);
  if (row_size != 0 && element.count > source.remaining() / row_size)
    throw Error(ErrorKind::kInput, "the file is truncated: it is too short for " + std::to_string(element.count) +
                                       " rows of element " + in_quotes(element.name));
}

template <class Source>
uint64_t read_list_length(Source& source, const PlyProperty& property) {
  const double length = source.number(*property.length_type);
  if (!(length >= 0.0) || length != std::floor(length)) fail_at(source.at, "a list has a length that is not a count");
  if (length > static_cast<double>(source.remaining() / source.min_item_size(property.type)))
    fail_at(source.at, "the file is truncated: a list is longer than the rest of it");
  return static_cast<uint64_t>(length);
}

template <class Source>
void skip_property(Source& source, const PlyProperty& property) {
  source.skip(property.type, property.length_type ? read_list_length(source, property) : 1);
}

template <class Source>
void skip_element(Source& source, const PlyElement& element) {
  check_row_count(source, element);
  if constexpr (Source::kBinary) {
    if (!element.has_lists()) {
      source.take(element.fixed_row_bytes() * element.count);
      return;
    }
  }
  if (element.properties.empty()) return;
  for (source.at.row = 0; source.at.row < element.count; ++source.at.row)
    for (const PlyProperty& property : element.properties) skip_property(source, property);
}

/// One attribute of the vertices: which properties it comes from and where it goes.
struct Attribute {
  std::array<size_t, 3> properties{};
  size_t size = 0;              ///< 2 or 3 of them
  float* destination = nullptr; ///< size floats per vertex
};

/// Sets attribute if all names are scalar properties of the element.
template <size_t kSize>
bool find_attribute(const PlyElement& element, const std::array<std::string_view, kSize>& names, Attribute& attribute) {
  for (size_t i = 0; i < kSize; ++i) {
    const auto found = element.find(names[i], false);
    if (!found) return false;
    attribute.properties[i] = *found;
  }
  attribute.size = kSize;
  return true;
}

/// Allocates the attributes that the file has; the caller has checked the count.
std::vector<Attribute> allocate_attributes(const PlyElement& element, Mesh& mesh) {
  using Names3 = std::array<std::string_view, 3>;
  using Names2 = std::array<std::string_view, 2>;
  const auto count = static_cast<size_t>(element.count);
  std::vector<Attribute> attributes;
  Attribute attribute;
  if (!find_attribute(element, Names3{"x", "y", "z"}, attribute))
    throw Error(ErrorKind::kInput, "the vertices have no x, y and z");
  mesh.positions.resize(count);
  attribute.destination = &mesh.positions[0].x;
  attributes.push_back(attribute);
  if (find_attribute(element, Names3{"nx", "ny", "nz"}, attribute)) {
    mesh.normals.resize(count);
    attribute.destination = &mesh.normals[0].x;
    attributes.push_back(attribute);
  }
  for (const Names2& names : {Names2{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}}) {
    if (!find_attribute(element, names, attribute)) continue;
    mesh.uvs.resize(count);
    attribute.destination = &mesh.uvs[0].x;
    attributes.push_back(attribute);
    break;
  }
  return attributes;
}

static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Vec2) == 2 * sizeof(float));

/// Vertex rows of any kind, value by value.
template <class Source>
void read_vertices_slowly(Source& source, const PlyElement& element, const std::vector<Attribute>& attributes) {
  struct Slot {
    float* destination = nullptr;
    size_t stride = 0;
  };
  std::vector<Slot> slots(element.properties.size());
  for (const Attribute& attribute : attributes)
    for (size_t i = 0; i < attribute.size; ++i)
      slots[attribute.properties[i]] = {attribute.destination + i, attribute.size};
  for (source.at.row = 0; source.at.row < element.count; ++source.at.row) {
    for (size_t i = 0; i < slots.size(); ++i) {
      if (slots[i].destination)
        slots[i].destination[source.at.row * slots[i].stride] = source.real(element.properties[i].type);
      else
        skip_property(source, element.properties[i]);
    }
  }
}

template <size_t kSize>
void copy_floats(const std::byte* from, size_t row_bytes, size_t rows, float* to) {
  for (size_t i = 0; i < rows; ++i) std::memcpy(to + kSize * i, from + row_bytes * i, kSize * sizeof(float));
}

template <bool kSwap>
void convert_column(PlyType type, const std::byte* from, size_t row_bytes, size_t rows, float* to, size_t to_stride) {
  visit_type(type, [&]<class T>() {
    for (size_t i = 0; i < rows; ++i) to[to_stride * i] = static_cast<float>(load<T, kSwap>(from + row_bytes * i));
  });
}

/// Binary rows of one size: attribute by attribute, in blocks of rows that stay in the first-level cache.
template <bool kSwap>
void read_vertex_table(BinarySource<kSwap>& source, const PlyElement& element,
                       const std::vector<Attribute>& attributes) {
  constexpr size_t kBlockRows = 256;
  const size_t row_bytes = element.fixed_row_bytes(), count = static_cast<size_t>(element.count);
  std::vector<size_t> offsets{0};
  for (const PlyProperty& property : element.properties) offsets.push_back(offsets.back() + byte_size(property.type));
  const std::byte* const table = source.take(element.count * row_bytes);
  for (size_t row = 0; row < count; row += kBlockRows) {
    const size_t rows = std::min(kBlockRows, count - row);
    for (const Attribute& a : attributes) {
      const std::byte* const from = table + row * row_bytes;
      float* const to = a.destination + row * a.size;
      bool packed = !kSwap;
      for (size_t i = 0; i < a.size; ++i)
        packed = packed && element.properties[a.properties[i]].type == PlyType::kFloat32 &&
                 a.properties[i] == a.properties[0] + i;
      if (packed) {
        (a.size == 3 ? copy_floats<3> : copy_floats<2>)(from + offsets[a.properties[0]], row_bytes, rows, to);
        continue;
      }
      for (size_t i = 0; i < a.size; ++i)
        convert_column<kSwap>(element.properties[a.properties[i]].type, from + offsets[a.properties[i]], row_bytes,
                              rows, to + i, a.size);
    }
  }
}

template <class Source>
void read_vertices(Source& source, const PlyElement& element, Mesh& mesh) {
  check_row_count(source, element);
  const std::vector<Attribute> attributes = allocate_attributes(element, mesh);
  if constexpr (Source::kBinary) {
    if (!element.has_lists()) return read_vertex_table(source, element, attributes);
  }
  read_vertices_slowly(source, element, attributes);
}

uint32_t to_index(double value) {
  return value >= 0.0 && value < static_cast<double>(kMaxVertices) && value == std::floor(value)
             ? static_cast<uint32_t>(value)
             : kBadIndex;
}

/// Reads one face's list of indices and appends its fan. Returns false if it has fewer than three corners.
template <class Source>
bool read_polygon(Source& source, const PlyProperty& property, std::vector<Triangle>& triangles) {
  const uint64_t length = read_list_length(source, property);
  if (length < 3) {
    source.skip(property.type, length);
    return false;
  }
  const uint32_t first = to_index(source.number(property.type));
  uint32_t previous = to_index(source.number(property.type));
  for (uint64_t i = 2; i < length; ++i) {
    const uint32_t corner = to_index(source.number(property.type));
    triangles.emplace_back(first, previous, corner);
    previous = corner;
  }
  return true;
}

/// The common layout: faces that are nothing but a list with a one-byte length and four-byte indices. Reads triangles
/// up to the first other polygon and returns how many.
template <bool kSwap>
uint64_t read_triangle_run(BinarySource<kSwap>& source, uint64_t max_count, std::vector<Triangle>& triangles) {
  constexpr uint64_t kRowBytes = 13;
  const uint64_t limit = std::min(max_count, source.remaining() / kRowBytes);
  const std::byte* const table = source.take(0);
  uint64_t count = 0;
  for (const std::byte* row = table; count < limit && row[0] == std::byte{3}; ++count, row += kRowBytes)
    triangles.emplace_back(load<uint32_t, kSwap>(row + 1), load<uint32_t, kSwap>(row + 5),
                           load<uint32_t, kSwap>(row + 9));
  source.take(count * kRowBytes);
  return count;
}

template <class Source>
void read_faces(Source& source, const PlyElement& element, Mesh& mesh, const ReportFn& report) {
  check_row_count(source, element);
  auto found = element.find("vertex_indices", true);
  if (!found) found = element.find("vertex_index", true);
  if (!found) throw Error(ErrorKind::kInput, "the faces have no list vertex_indices or vertex_index");
  const PlyProperty& indices = element.properties[*found];
  const uint64_t triangle_size =
      source.min_row_size(element) + 3 * source.min_item_size(indices.type); // the estimate must not trust the count
  mesh.triangles.reserve(static_cast<size_t>(std::min(element.count, source.remaining() / triangle_size)));
  const bool is_simple = element.properties.size() == 1 && byte_size(*indices.length_type) == 1 &&
                         (indices.type == PlyType::kInt32 || indices.type == PlyType::kUint32);
  uint64_t too_short = 0;
  for (uint64_t& row = source.at.row; row < element.count;) {
    if constexpr (Source::kBinary) {
      if (is_simple) row += read_triangle_run(source, element.count - row, mesh.triangles);
      if (row == element.count) break;
    }
    for (size_t i = 0; i < element.properties.size(); ++i) {
      if (i != *found)
        skip_property(source, element.properties[i]);
      else if (!read_polygon(source, indices, mesh.triangles))
        ++too_short;
    }
    ++row;
  }
  if (too_short != 0 && report)
    report(Severity::kWarning, 0, std::to_string(too_short) + " faces have fewer than three corners: ignored");
}

template <class Source>
PlyMesh read_body(Source source, const PlyHeader& header, const ReportFn& report) {
  PlyMesh result;
  int wanted = 2;
  for (const PlyElement& element : header.elements) {
    if (wanted == 0) break;
    if (element.name == "vertex") {
      read_vertices(source, element, result.mesh);
      --wanted;
    } else if (element.name == "face") {
      read_faces(source, element, result.mesh, report);
      --wanted;
    } else {
      skip_element(source, element);
    }
  }
  result.dropped_triangles = drop_bad_triangles(result.mesh, report);
  return result;
}

/// Exactly one vertex and one face element, both with rows.
void check_elements(const PlyHeader& header) {
  for (const char* const name : {"vertex", "face"}) {
    const auto is_named = [&](const PlyElement& e) { return e.name == name; };
    const auto count = std::count_if(header.elements.begin(), header.elements.end(), is_named);
    if (count > 1) throw Error(ErrorKind::kInput, "more than one element '" + std::string(name) + "'");
    if (count == 0 || header.find(name)->count == 0)
      throw Error(ErrorKind::kInput, "no " + std::string(name == std::string_view("vertex") ? "vertices" : "faces"));
  }
  if (header.find("vertex")->count >= kMaxVertices)
    throw Error(ErrorKind::kInput, "more than " + std::to_string(kMaxVertices - 1) +
                                       " vertices claimed: the file is damaged or too large");
}

} // namespace

PlyMesh read_ply(std::span<const std::byte> bytes, const ReportFn& report) {
  const PlyHeader header = parse_ply_header(bytes);
  check_elements(header);
  switch (header.format) {
  case PlyFormat::kAscii:
    return read_body(AsciiSource(bytes, header.body_offset), header, report);
  case PlyFormat::kBigEndian:
    return read_body(BinarySource<true>(bytes.subspan(header.body_offset)), header, report);
  case PlyFormat::kLittleEndian:
    break;
  }
  return read_body(BinarySource<false>(bytes.subspan(header.body_offset)), header, report);
}

} // namespace packtrace
