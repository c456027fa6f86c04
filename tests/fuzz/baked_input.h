#pragma once

#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include "compress/format/pages/page_codec.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/file_hashes.h"
#include "tests/fuzz/fuzz_target.h"

namespace packtrace::fuzz {

/// Repairs sizes and hashes of a resident file after changes, so that validation looks further than these.
inline void repair_resident(std::span<std::byte> bytes) {
  baked::FileHeader header;
  if (bytes.size() < sizeof header) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  header.magic = baked::kMagic;
  header.header_bytes = sizeof header;
  header.file_bytes = bytes.size();
  std::memcpy(bytes.data(), &header, sizeof header);
  test::rehash<baked::FileHeader>(bytes);
}

/// Same for a paged file, whose last page is made to end with the file. Other files are treated as resident.
inline void repair(std::span<std::byte> bytes) {
  baked::PagedHeader header;
  if (!is_paged_file(bytes) || bytes.size() < sizeof header) return repair_resident(bytes);
  std::memcpy(&header, bytes.data(), sizeof header);
  header.file_bytes = bytes.size();
  std::memcpy(bytes.data(), &header, sizeof header);
  const uint64_t limit = bytes.size(), table_bytes = uint64_t{header.page_count} * sizeof(baked::PageRecord);
  if (header.page_count > 0 && sizeof header + table_bytes <= limit) {
    std::byte* const table = bytes.data() + sizeof header;
    uint64_t at = sizeof header + table_bytes;
    for (const uint64_t part : {header.head_disk_bytes, header.tail_disk_bytes, header.node_disk_bytes})
      at += std::min(part, limit + 1);
    baked::PageRecord page;
    for (uint32_t i = 0; i < header.page_count && at <= limit; ++i) {
      std::memcpy(&page, table + i * sizeof page, sizeof page);
      if (i + 1 == header.page_count) page.disk_bytes = static_cast<uint32_t>(limit - at);
      at += page.disk_bytes;
      std::memcpy(table + i * sizeof page, &page, sizeof page);
    }
  }
  test::rehash_pages(bytes);
}

/// Calls read(), which may reject the file with Error(kInput) or Error(kUnsupported).
template <class Read>
void expect_read_or_refused(Read read) {
  try {
    read();
  } catch (const Error& error) {
    require(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kUnsupported, "kind of error");
  }
}

} // namespace packtrace::fuzz
