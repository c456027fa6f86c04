#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include <xxhash.h>

#include "compress/format/layout/baked_format.h"

namespace packtrace {

/// Offset of the next section: `bytes` rounded up to the alignment.
constexpr uint64_t align_section(uint64_t bytes) {
  return (bytes + baked::kSectionAlignment - 1) / baked::kSectionAlignment * baked::kSectionAlignment;
}

/// Assembles a file from a header and sections in order. Each section starts at a multiple of kSectionAlignment, gaps
/// are zero, and both hashes are set.
/// @param header with magic and version set
/// @param record_bytes record size of each section
template <class Header, size_t kCount>
std::vector<std::byte> assemble_section_file(Header header, const std::array<std::span<const std::byte>, kCount>& parts,
                                             const std::array<uint32_t, kCount>& record_bytes) {
  header.header_bytes = sizeof header;
  header.section_count = kCount;
  uint64_t end = sizeof header;
  for (size_t i = 0; i < kCount; ++i) {
    header.sections[i] = {end, parts[i].size(), record_bytes[i], 0};
    end = align_section(end + parts[i].size());
  }
  header.file_bytes = end;

  std::vector<std::byte> file(static_cast<size_t>(end));
  for (size_t i = 0; i < kCount; ++i)
    if (!parts[i].empty()) std::memcpy(file.data() + header.sections[i].offset, parts[i].data(), parts[i].size());
  const XXH128_hash_t hash = XXH3_128bits(file.data() + sizeof header, file.size() - sizeof header);
  header.content_hash = {hash.low64, hash.high64};
  header.header_hash = XXH3_64bits(&header, offsetof(Header, header_hash));
  std::memcpy(file.data(), &header, sizeof header);
  return file;
}

} // namespace packtrace
