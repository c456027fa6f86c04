#include "pbrt_import/files/ply.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/ply_header.h"
#include "pbrt_import/files/ply_source.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

using ply::AsciiSource, ply::BinarySource, ply::fail_at, ply::load, ply::visit_type;

constexpr std::string_view kVertices = "vertex", kFaces = "face", kStrips = "tristrips";
bool is_read(const PlyElement& element) {
  return element.count > 0 && (element.name == kVertices || element.name == kFaces || element.name == kStrips);
}

constexpr uint32_t kBadIndex = ~0u;                  // out of range for every mesh, so dropped as a bad index
constexpr uint64_t kMaxVertices = uint64_t{1} << 31; // makes negative indices out of range as unsigned

/// Counts the memory of the mesh before it is allocated.
class MeshMemory {
public:
  explicit MeshMemory(MemoryReservation* memory) : memory_(memory) {}

  void add(uint64_t bytes) {
    bytes_ += bytes;
    if (memory_) memory_->cover(bytes_, "its mesh");
  }
  /// Reserves room for more triangles, growing by at least half.
  void reserve(std::vector<Triangle>& triangles, uint64_t more) {
    const uint64_t old = triangles.capacity(), needed = triangles.size() + more;
    if (needed <= old) return;
    const uint64_t larger = std::max(needed, old + old / 2);
    add(larger * sizeof(Triangle)); // both arrays exist during the copy
    triangles.reserve(static_cast<size_t>(larger));
    bytes_ -= old * sizeof(Triangle);
  }

private:
  MemoryReservation* memory_;
  uint64_t bytes_ = 0;
};

/// Throws Error(kInput) if the file is too short for the rows that an element claims, so that allocating them is safe.
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
  const uint64_t most = source.remaining() / source.min_item_size(property.type);
  if (length > static_cast<double>(most))
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

/// A vertex attribute: its source properties and its destination.
struct Attribute {
  std::array<size_t, 3> properties{};
  size_t size = 0;              ///< number of components, 2 or 3
  float* destination = nullptr; ///< `size` floats per vertex
};

/// Sets the properties of `attribute` and returns true if the element has scalar properties of all these names.
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

/// Allocates the attributes that the file has. Precondition: the row count has been checked.
std::vector<Attribute> allocate_attributes(const PlyElement& element, Mesh& mesh, MeshMemory& memory) {
  using Names3 = std::array<std::string_view, 3>;
  using Names2 = std::array<std::string_view, 2>;
  const auto count = static_cast<size_t>(element.count);
  std::vector<Attribute> attributes;
  Attribute attribute;
  if (!find_attribute(element, Names3{"x", "y", "z"}, attribute))
    throw Error(ErrorKind::kInput, "the vertices have no x, y and z");
  memory.add(element.count * (sizeof(Vec3) + 1)); // one more byte for clean_up_mesh()
  mesh.positions.resize(count);
  attribute.destination = &mesh.positions[0].x;
  attributes.push_back(attribute);
  if (find_attribute(element, Names3{"nx", "ny", "nz"}, attribute)) {
    memory.add(element.count * sizeof(Vec3));
    mesh.normals.resize(count);
    attribute.destination = &mesh.normals[0].x;
    attributes.push_back(attribute);
  }
  for (const Names2& names : {Names2{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}}) {
    if (!find_attribute(element, names, attribute)) continue;
    memory.add(element.count * sizeof(Vec2));
    mesh.uvs.resize(count);
    attribute.destination = &mesh.uvs[0].x;
    attributes.push_back(attribute);
    break;
  }
  return attributes;
}

static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Vec2) == 2 * sizeof(float));

/// Reads vertex rows of any layout, value by value.
template <class Source>
void read_vertices_by_value(Source& source, const PlyElement& element, const std::vector<Attribute>& attributes) {
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

/// Reads binary rows of fixed size, attribute by attribute, in blocks of rows that fit the L1 cache.
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
void read_vertices(Source& source, const PlyElement& element, Mesh& mesh, MeshMemory& memory) {
  check_row_count(source, element);
  const std::vector<Attribute> attributes = allocate_attributes(element, mesh, memory);
  if constexpr (Source::kBinary) {
    if (!element.has_lists()) return read_vertex_table(source, element, attributes);
  }
  read_vertices_by_value(source, element, attributes);
}

uint32_t to_index(double value) {
  return value >= 0.0 && value < static_cast<double>(kMaxVertices) && value == std::floor(value)
             ? static_cast<uint32_t>(value)
             : kBadIndex;
}

/// Reads the index list of a face and appends its triangle fan. Returns false if it has fewer than three corners.
template <class Source>
bool read_polygon(Source& source, const PlyProperty& property, std::vector<Triangle>& triangles, MeshMemory& memory) {
  const uint64_t length = read_list_length(source, property);
  if (length < 3) {
    source.skip(property.type, length);
    return false;
  }
  memory.reserve(triangles, length - 2);
  const uint32_t first = to_index(source.number(property.type));
  uint32_t previous = to_index(source.number(property.type));
  for (uint64_t i = 2; i < length; ++i) {
    const uint32_t corner = to_index(source.number(property.type));
    triangles.emplace_back(first, previous, corner);
    previous = corner;
  }
  return true;
}

/// Fast path for faces that only have a list with a one-byte length and four-byte indices. Reads triangles up to the
/// first other polygon and returns their number.
template <bool kSwap>
uint64_t read_triangle_run(BinarySource<kSwap>& source, uint64_t max_count, std::vector<Triangle>& triangles,
                           MeshMemory& memory) {
  constexpr uint64_t kRowBytes = 13, kMaxTrianglesAtOnce = 1u << 16;
  const uint64_t limit = std::min({max_count, source.remaining() / kRowBytes, kMaxTrianglesAtOnce});
  memory.reserve(triangles, limit);
  const std::byte* const table = source.take(0);
  uint64_t count = 0;
  for (const std::byte* row = table; count < limit && row[0] == std::byte{3}; ++count, row += kRowBytes)
    triangles.emplace_back(load<uint32_t, kSwap>(row + 1), load<uint32_t, kSwap>(row + 5),
                           load<uint32_t, kSwap>(row + 9));
  source.take(count * kRowBytes);
  return count;
}

/// Index of the property of faces or strips that lists their vertices. Throws Error(kInput) if there is none.
size_t index_list_of(const PlyElement& element) {
  auto found = element.find("vertex_indices", true);
  if (!found) found = element.find("vertex_index", true);
  if (!found)
    throw Error(ErrorKind::kInput, std::string(element.name == kFaces ? "the faces have" : "the strips have") +
                                       " no list vertex_indices or vertex_index");
  return *found;
}

/// Reads one list of triangle strips, each terminated by -1 or the end of the list, and appends their triangles; every
/// second one is flipped. Triangles with a repeated index only connect parts of a strip and are omitted. Returns the
/// number of strips with fewer than three corners.
template <class Source>
uint64_t read_strip_list(Source& source, const PlyProperty& property, std::vector<Triangle>& triangles,
                         MeshMemory& memory) {
  const double restart = property.type == PlyType::kUint32 ? 4294967295.0 : -1.0;
  const uint64_t length = read_list_length(source, property);
  memory.reserve(triangles, length);
  uint64_t too_short = 0, corners = 0; // corners of the current strip
  uint32_t a = 0, b = 0;
  const auto end_strip = [&] { too_short += corners > 0 && corners < 3, corners = 0; };
  for (uint64_t i = 0; i < length; ++i) {
    const double value = source.number(property.type);
    if (value == restart) {
      end_strip();
      continue;
    }
    const uint32_t c = to_index(value);
    if (corners >= 2 && a != b && b != c && a != c)
      triangles.push_back(corners % 2 == 0 ? Triangle{a, b, c} : Triangle{b, a, c});
    a = b, b = c, ++corners;
  }
  end_strip();
  return too_short;
}

template <class Source>
void read_strips(Source& source, const PlyElement& element, Mesh& mesh, const ReportFn& report, MeshMemory& memory) {
  check_row_count(source, element);
  const size_t indices = index_list_of(element);
  uint64_t too_short = 0;
  for (uint64_t& row = source.at.row; row < element.count; ++row)
    for (size_t i = 0; i < element.properties.size(); ++i)
      if (i == indices)
        too_short += read_strip_list(source, element.properties[i], mesh.triangles, memory);
      else
        skip_property(source, element.properties[i]);
  if (too_short != 0 && report)
    report(Severity::kWarning, 0, std::to_string(too_short) + " strips have fewer than three corners: ignored");
}

template <class Source>
void read_faces(Source& source, const PlyElement& element, Mesh& mesh, const ReportFn& report, MeshMemory& memory) {
  check_row_count(source, element);
  const size_t index_list = index_list_of(element);
  const PlyProperty& indices = element.properties[index_list];
  const uint64_t triangle_size =
      source.min_row_size(element) + 3 * source.min_item_size(indices.type); // the reservation must not trust the count
  memory.reserve(mesh.triangles, std::min(element.count, source.remaining() / triangle_size));
  const bool is_simple = element.properties.size() == 1 && byte_size(*indices.length_type) == 1 &&
                         (indices.type == PlyType::kInt32 || indices.type == PlyType::kUint32);
  uint64_t too_short = 0;
  for (uint64_t& row = source.at.row; row < element.count;) {
    if constexpr (Source::kBinary) {
      const uint64_t run = is_simple ? read_triangle_run(source, element.count - row, mesh.triangles, memory) : 0;
      row += run;
      if (row == element.count) break;
      if (run > 0) continue;
    }
    for (size_t i = 0; i < element.properties.size(); ++i) {
      if (i != index_list)
        skip_property(source, element.properties[i]);
      else if (!read_polygon(source, indices, mesh.triangles, memory))
        ++too_short;
    }
    ++row;
  }
  if (too_short != 0 && report)
    report(Severity::kWarning, 0, std::to_string(too_short) + " faces have fewer than three corners: ignored");
}

/// Notes colours. pbrt ignores them, so a scene may have them without a warning.
void report_colours(const PlyHeader& header, const ReportFn& report) {
  for (const std::string_view element : {kVertices, kFaces})
    for (const std::string_view red : {"red", "diffuse_red", "r"})
      if (const PlyElement* const found = header.find(element); report && found && found->find(red, false))
        report(Severity::kNote, 0, "colours of the element '" + std::string(element) + "' are left out");
}

template <class Source>
PlyMesh read_body(Source source, const PlyHeader& header, const ReportFn& report, MeshMemory memory) {
  PlyMesh result;
  size_t wanted = 0;
  for (const PlyElement& element : header.elements) wanted += is_read(element);
  for (const PlyElement& element : header.elements) {
    if (wanted == 0) break;
    wanted -= is_read(element);
    if (!is_read(element))
      skip_element(source, element);
    else if (element.name == kVertices)
      read_vertices(source, element, result.mesh, memory);
    else if (element.name == kFaces)
      read_faces(source, element, result.mesh, report, memory);
    else
      read_strips(source, element, result.mesh, report, memory);
  }
  report_colours(header, report);
  result.dropped_triangles = clean_up_mesh(result.mesh, report);
  return result;
}

/// Throws Error(kInput) unless there are vertices and faces or strips, and each of these elements occurs at most once.
void check_elements(const PlyHeader& header) {
  const auto rows = [&](std::string_view name) {
    const auto is_named = [&](const PlyElement& e) { return e.name == name; };
    if (std::count_if(header.elements.begin(), header.elements.end(), is_named) > 1)
      throw Error(ErrorKind::kInput, "more than one element '" + std::string(name) + "'");
    const PlyElement* const element = header.find(name);
    return element ? element->count : 0;
  };
  if (rows(kVertices) == 0) throw Error(ErrorKind::kInput, "no vertices");
  const uint64_t face_rows = rows(kFaces), strip_rows = rows(kStrips); // both calls are needed for their checks
  if (face_rows == 0 && strip_rows == 0) throw Error(ErrorKind::kInput, "no faces");
  if (header.find(kVertices)->count >= kMaxVertices)
    throw Error(ErrorKind::kInput, "more than " + std::to_string(kMaxVertices - 1) +
                                       " vertices claimed: the file is damaged or too large");
}

} // namespace

PlyMesh read_ply(std::span<const std::byte> bytes, const ReportFn& report, MemoryReservation* memory) {
  const PlyHeader header = parse_ply_header(bytes);
  check_elements(header);
  switch (header.format) {
  case PlyFormat::kAscii:
    return read_body(AsciiSource(bytes, header.body_offset), header, report, MeshMemory(memory));
  case PlyFormat::kBigEndian:
    return read_body(BinarySource<true>(bytes.subspan(header.body_offset)), header, report, MeshMemory(memory));
  case PlyFormat::kLittleEndian:
    break;
  }
  return read_body(BinarySource<false>(bytes.subspan(header.body_offset)), header, report, MeshMemory(memory));
}

} // namespace packtrace
