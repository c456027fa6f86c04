#include "pbrt_import/gltf/gltf_accessors.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

namespace packtrace::gltf {
namespace {

enum class Component : uint32_t {
  kInt8 = 5120,
  kUint8 = 5121,
  kInt16 = 5122,
  kUint16 = 5123,
  kUint32 = 5125,
  kFloat = 5126
};

uint32_t bytes_of(Component type) {
  switch (type) {
  case Component::kInt8:
  case Component::kUint8:
    return 1;
  case Component::kInt16:
  case Component::kUint16:
    return 2;
  default:
    return 4;
  }
}

Component read_component(const Value& value) {
  const uint64_t number = value.integer();
  for (const Component type : {Component::kInt8, Component::kUint8, Component::kInt16, Component::kUint16,
                               Component::kUint32, Component::kFloat})
    if (number == static_cast<uint64_t>(type)) return type;
  value.fail("is not a component type");
}

/// Shape of an accessor's elements.
struct Layout {
  Component component = Component::kFloat;
  uint32_t rows = 1, columns = 1;
  bool normalized = false;
  uint64_t count = 0;

  uint32_t components() const { return rows * columns; }
  /// Columns of matrices begin at multiples of 4 bytes.
  uint32_t column_bytes() const {
    const uint32_t bytes = rows * bytes_of(component);
    return columns > 1 ? (bytes + 3) / 4 * 4 : bytes;
  }
  uint32_t element_bytes() const { return (columns - 1) * column_bytes() + rows * bytes_of(component); }
};

Layout read_layout(const Value& accessor) {
  Layout layout;
  layout.component = read_component(accessor.at("componentType"));
  layout.count = accessor.at("count").integer();
  if (const std::optional<Value> normalized = accessor.find("normalized")) layout.normalized = normalized->flag();
  const std::string type = accessor.at("type").text();
  if (type == "SCALAR")
    layout.rows = 1;
  else if (type == "VEC2" || type == "VEC3" || type == "VEC4")
    layout.rows = static_cast<uint32_t>(type[3] - '0');
  else if (type == "MAT2" || type == "MAT3" || type == "MAT4")
    layout.rows = layout.columns = static_cast<uint32_t>(type[3] - '0');
  else
    accessor.fail("has the unknown type \"" + type + "\"");
  if (layout.count > std::numeric_limits<int32_t>::max()) accessor.fail("has more than 2^31 - 1 elements");
  return layout;
}

template <class T, class Out>
Out convert(T value, bool normalized) {
  if constexpr (std::is_same_v<Out, float> && std::is_integral_v<T>) {
    if (normalized)
      return std::max(static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
  }
  return static_cast<Out>(value);
}

template <class T, class Out>
void copy_as(const std::byte* from, size_t stride, const Layout& layout, uint64_t count, Out* to) {
  // Contiguous, as in most files; the compiler vectorises this.
  if (layout.columns == 1 && stride == layout.rows * sizeof(T)) {
    const uint64_t values = count * layout.rows;
    if constexpr (std::is_same_v<T, Out>) {
      if (values > 0) std::memcpy(to, from, static_cast<size_t>(values) * sizeof(T));
    } else {
      for (uint64_t i = 0; i < values; ++i) {
        T value;
        std::memcpy(&value, from + i * sizeof(T), sizeof value);
        to[i] = convert<T, Out>(value, layout.normalized);
      }
    }
    return;
  }
  for (uint64_t i = 0; i < count; ++i, from += stride)
    for (uint32_t column = 0; column < layout.columns; ++column)
      for (uint32_t row = 0; row < layout.rows; ++row) {
        T value;
        std::memcpy(&value, from + column * layout.column_bytes() + row * sizeof(T), sizeof value);
        *to++ = convert<T, Out>(value, layout.normalized);
      }
}

/// Copies elements whose range was checked.
template <class Out>
void copy_elements(const std::byte* from, size_t stride, const Layout& layout, uint64_t count, Out* to) {
  switch (layout.component) {
  case Component::kInt8:
    return copy_as<int8_t>(from, stride, layout, count, to);
  case Component::kUint8:
    return copy_as<uint8_t>(from, stride, layout, count, to);
  case Component::kInt16:
    return copy_as<int16_t>(from, stride, layout, count, to);
  case Component::kUint16:
    return copy_as<uint16_t>(from, stride, layout, count, to);
  case Component::kUint32:
    return copy_as<uint32_t>(from, stride, layout, count, to);
  case Component::kFloat:
    return copy_as<float>(from, stride, layout, count, to);
  }
}

/// Elements of a buffer view from an offset on. Throws if they do not lie within the view.
/// @param range accessor, or part of a sparse one, with bufferView and byteOffset
/// @param stride distance of elements; 0: they follow one another
const std::byte* elements(Document& document, const Value& range, uint64_t count, uint64_t element_bytes,
                          uint64_t stride) {
  const std::span<const std::byte> view = document.view_bytes(range.at("bufferView").integer());
  const uint64_t offset = range.find_integer("byteOffset").value_or(0);
  if (stride == 0) stride = element_bytes;
  if (count == 0) return view.data();
  // count < 2^31 and stride < 2^32, so this does not overflow.
  const uint64_t bytes = (count - 1) * stride + element_bytes;
  if (offset > view.size() || bytes > view.size() - offset) range.fail("lies outside its buffer view");
  return view.data() + offset;
}

template <class Out>
void replace_sparse(Document& document, const Value& sparse, const Layout& layout, std::vector<Out>& values) {
  const uint64_t count = sparse.at("count").integer();
  if (count > layout.count) sparse.fail("has more elements than its accessor");
  const Value indices = sparse.at("indices"), replacements = sparse.at("values");
  Layout index_layout;
  index_layout.component = read_component(indices.at("componentType"));
  if (index_layout.component == Component::kFloat) indices.fail("is not of integers");
  std::vector<uint32_t> numbers(static_cast<size_t>(count));
  const uint32_t index_bytes = index_layout.element_bytes();
  copy_elements(elements(document, indices, count, index_bytes, 0), index_bytes, index_layout, count, numbers.data());
  const std::byte* from = elements(document, replacements, count, layout.element_bytes(), 0);
  for (const uint32_t number : numbers) {
    if (number >= layout.count) indices.fail("has an index out of range");
    copy_elements(from, layout.element_bytes(), layout, 1, values.data() + size_t{number} * layout.components());
    from += layout.element_bytes();
  }
}

template <class Out>
std::vector<Out> read_values(Document& document, const Value& accessor, const Layout& layout) {
  const uint64_t size = layout.count * layout.components();
  MemoryReservation& memory = document.values_memory();
  memory.resize(memory.bytes() + size * sizeof(Out), "an accessor of the glTF document");
  std::vector<Out> values(static_cast<size_t>(size), Out{});
  if (accessor.has("bufferView")) {
    const Value view = document.element("bufferViews", accessor.at("bufferView").integer());
    const uint64_t stride = view.find_integer("byteStride").value_or(0);
    if (stride > 0 && (stride < layout.element_bytes() || stride > 4096))
      view.fail("has a byteStride that does not fit its accessor");
    const std::byte* const from = elements(document, accessor, layout.count, layout.element_bytes(), stride);
    copy_elements(from, static_cast<size_t>(stride == 0 ? layout.element_bytes() : stride), layout, layout.count,
                  values.data());
  }
  if (const std::optional<Value> sparse = accessor.find("sparse")) replace_sparse(document, *sparse, layout, values);
  return values;
}

} // namespace

AccessorValues read_floats(Document& document, uint64_t number) {
  const Value accessor = document.element("accessors", number);
  const Layout layout = read_layout(accessor);
  return {read_values<float>(document, accessor, layout), layout.count, layout.components()};
}

std::vector<uint32_t> read_indices(Document& document, uint64_t number) {
  const Value accessor = document.element("accessors", number);
  const Layout layout = read_layout(accessor);
  const bool is_unsigned = layout.component == Component::kUint8 || layout.component == Component::kUint16 ||
                           layout.component == Component::kUint32;
  if (!is_unsigned || layout.components() != 1) accessor.fail("is not of unsigned integers");
  return read_values<uint32_t>(document, accessor, layout);
}

} // namespace packtrace::gltf
