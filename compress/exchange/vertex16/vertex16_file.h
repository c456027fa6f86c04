#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "compress/exchange/vertex16/vertex16_format.h"

namespace packtrace::vertex16 {

/// Typed spans over the sections of a vertex16 file. They do not own memory.
struct Sections {
  std::span<const glm::uvec4> vertices;
  std::span<const uint16_t> indices16;
  std::span<const uint32_t> indices32;
  std::span<const GeometryRecord> geometries;
  std::span<const DrawRecord> draws;
  std::span<const InstanceRecord> instances;
  std::span<const uint32_t> material_slots;
  std::span<const baked::MaterialRecord> materials;
  std::span<const baked::MaskRecord> masks;
  std::span<const uint32_t> mask_words;
  std::span<const baked::TextureRecord> textures;
  std::span<const uint8_t> texture_bytes;
  std::span<const char> strings;

  /// Index into `vertices` of a corner of the draw's triangles, 0 .. index_count - 1.
  uint32_t vertex(const DrawRecord& draw, uint32_t corner) const {
    const uint32_t at = draw.first_index + corner;
    return draw.vertex_offset + (geometries[draw.geometry].index_bits == 16 ? indices16[at] : indices32[at]);
  }
};

/// Assembles a file image from its sections: header, hashes, alignment.
std::vector<std::byte> assemble(const Sections& sections);

/// Checks hashes, sizes, and every range and index, so that all references of records are valid. Of materials, masks
/// and strings only the references are checked.
/// @param bytes 8-byte aligned
/// @param name of the file in error messages
/// Throws Error(kInput) with the fault, Error(kUnsupported) for other versions.
Sections validate(std::span<const std::byte> bytes, const std::string& name);

} // namespace packtrace::vertex16
