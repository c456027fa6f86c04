#include "compress/format/baked_image.h"

#include <cstring>

#include <xxhash.h>

namespace packtrace {
namespace {

constexpr uint64_t align_up(uint64_t bytes) {
  return (bytes + baked::kSectionAlignment - 1) / baked::kSectionAlignment * baked::kSectionAlignment;
}

} // namespace

std::vector<std::byte> assemble_baked_file(const BakedSections& sections) {
  const std::array<std::span<const std::byte>, baked::kSectionCount> parts = {
      std::as_bytes(sections.geometries),     std::as_bytes(sections.clusters),
      std::as_bytes(sections.payload),        std::as_bytes(sections.materials),
      std::as_bytes(sections.instances),      std::as_bytes(sections.masks),
      std::as_bytes(sections.mask_words),     std::as_bytes(sections.textures),
      std::as_bytes(sections.texture_bytes),  std::as_bytes(sections.cameras),
      std::as_bytes(sections.strings),        std::as_bytes(sections.summary),
      std::as_bytes(sections.material_slots), std::as_bytes(sections.requirements)};
  baked::FileHeader header{};
  header.magic = baked::kMagic;
  header.version = baked::kVersion;
  header.header_bytes = sizeof header;
  header.section_count = baked::kSectionCount;
  uint64_t end = sizeof header;
  for (size_t i = 0; i < parts.size(); ++i) {
    header.sections[i] = {end, parts[i].size(), baked::kRecordBytes[i], 0};
    end = align_up(end + parts[i].size());
  }
  header.file_bytes = end;

  std::vector<std::byte> file(static_cast<size_t>(end));
  for (size_t i = 0; i < parts.size(); ++i)
    if (!parts[i].empty()) std::memcpy(file.data() + header.sections[i].offset, parts[i].data(), parts[i].size());
  const XXH128_hash_t hash = XXH3_128bits(file.data() + sizeof header, file.size() - sizeof header);
  header.content_hash = {hash.low64, hash.high64};
  header.header_hash = XXH3_64bits(&header, offsetof(baked::FileHeader, header_hash));
  std::memcpy(file.data(), &header, sizeof header);
  return file;
}

} // namespace packtrace
