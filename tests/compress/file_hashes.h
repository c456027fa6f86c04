#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <span>

#include <xxhash.h>

#include "compress/format/pages/page_codec.h"

namespace packtrace::test {

/// Recomputes the hashes of content and header, so that damage reaches the checks behind them.
/// @param Header header type of the file: baked::FileHeader or vertex16::Header
template <class Header>
void rehash(std::span<std::byte> bytes) {
  if (bytes.size() < sizeof(Header)) return;
  Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  const XXH128_hash_t content = XXH3_128bits(bytes.data() + sizeof header, bytes.size() - sizeof header);
  header.content_hash = {content.low64, content.high64};
  header.header_hash = XXH3_64bits(&header, offsetof(Header, header_hash));
  std::memcpy(bytes.data(), &header, sizeof header);
}

/// Like rehash() for the disk form: recomputes the hashes of the header and, if the sizes are plausible, of pages and
/// table.
inline void rehash_pages(std::span<std::byte> bytes) {
  baked::PagedHeader header;
  if (bytes.size() < sizeof header) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  const uint64_t limit = bytes.size(), table_bytes = uint64_t{header.page_count} * sizeof(baked::PageRecord);
  uint64_t data = sizeof header + table_bytes; // start of the pages
  for (const uint64_t part :
       {header.head_disk_bytes, header.tail_disk_bytes, header.motion_bytes, header.node_disk_bytes})
    data += std::min(part, limit + 1);
  if (data <= limit) {
    std::byte* const table = bytes.data() + sizeof header;
    uint64_t at = data;
    for (uint32_t i = 0; i < header.page_count; ++i) {
      baked::PageRecord page;
      std::memcpy(&page, table + i * sizeof page, sizeof page);
      if (page.disk_bytes > limit - at) break;
      page.hash = XXH3_64bits(bytes.data() + at, page.disk_bytes);
      at += page.disk_bytes;
      std::memcpy(table + i * sizeof page, &page, sizeof page);
    }
    header.table_hash = XXH3_64bits(table, static_cast<size_t>(data) - sizeof header);
  }
  header.header_hash = XXH3_64bits(&header, offsetof(baked::PagedHeader, header_hash));
  std::memcpy(bytes.data(), &header, sizeof header);
}

} // namespace packtrace::test
