#include "compress/format/file/baked_image.h"

#include <array>

#include "compress/format/layout/section_file.h"

namespace packtrace {

std::vector<std::byte> assemble_baked_file(const BakedSections& sections) {
  std::vector<uint8_t> texels_and_shading;
  std::span<const uint8_t> texture_bytes = sections.texture_bytes;
  if (!sections.shading.empty()) {
    texels_and_shading.assign(texture_bytes.begin(), texture_bytes.end());
    texels_and_shading.insert(texels_and_shading.end(), sections.shading.begin(), sections.shading.end());
    texture_bytes = texels_and_shading;
  }
  const std::array<std::span<const std::byte>, baked::kSectionCount> parts = {
      std::as_bytes(sections.geometries),     std::as_bytes(sections.clusters),     std::as_bytes(sections.payload),
      std::as_bytes(sections.materials),      std::as_bytes(sections.instances),    std::as_bytes(sections.masks),
      std::as_bytes(sections.mask_words),     std::as_bytes(sections.textures),     std::as_bytes(texture_bytes),
      std::as_bytes(sections.cameras),        std::as_bytes(sections.strings),      std::as_bytes(sections.summary),
      std::as_bytes(sections.material_slots), std::as_bytes(sections.requirements), std::as_bytes(sections.lod_levels),
      std::as_bytes(sections.lod_groups),     std::as_bytes(sections.lod_links),    std::as_bytes(sections.trees),
      std::as_bytes(sections.rigid_motion),   std::as_bytes(sections.deformation),  std::as_bytes(sections.nodes)};
  baked::FileHeader header{};
  header.magic = baked::kMagic;
  header.version = baked::kVersion;
  return assemble_section_file(header, parts, baked::kRecordBytes);
}

} // namespace packtrace
