#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packtrace {

enum class PlyFormat : uint8_t { kAscii, kLittleEndian, kBigEndian };
enum class PlyType : uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

constexpr size_t byte_size(PlyType type) {
  constexpr uint8_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<size_t>(type)];
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;   ///< type of the value, or of each list item
  std::optional<PlyType> length_type; ///< integer type of the list length; lists only
};

struct PlyElement {
  std::string name;
  uint64_t count = 0; ///< claimed number of rows, not yet checked against the file
  std::vector<PlyProperty> properties;

  /// Bytes of a binary row, without list items.
  uint64_t fixed_row_bytes() const;
  bool has_lists() const;
  /// Index of a property by name and kind; nullopt if there is none.
  std::optional<size_t> find(std::string_view property_name, bool is_list) const;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
  size_t body_offset = 0; ///< offset of the body in bytes

  /// First element of a name; null if there is none.
  const PlyElement* find(std::string_view element_name) const;
};

/// Parses the header, up to and including end_header. Lines may end in LF, CR LF or CR.
/// Throws Error(kInput), "line N: ...", if it is not a PLY 1.0 header.
PlyHeader parse_ply_header(std::span<const std::byte> bytes);

} // namespace packtrace
