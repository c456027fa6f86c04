#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "compress/format/layout/baked_format.h"
#include "compress/format/pages/page_codec.h"

namespace packtrace {

/// What a page needs to know of its file.
struct PagePlace {
  std::span<const baked::GeometryRecord> geometries; ///< ranges without gaps, encodings and steps checked
  uint64_t first_cluster = 0;                        ///< of the page, in the cluster section
  uint64_t payload_offset = 0;                       ///< of the page, in the payload section
};

/// Decodes pages, one after the other; keeps its memory. One a thread.
class PageDecoder {
public:
  PageDecoder();
  ~PageDecoder();

  /// @param page record.disk_bytes bytes; their hash is not looked at
  /// @param clusters record.cluster_count records; first_triangle and first_vertex are left 0 unless record.form is
  ///        kNone, since they depend on the pages before
  /// @param payload record.payload_bytes bytes
  /// @return false where the bytes are not what an encoder writes; then the outputs hold anything
  bool decode(const baked::PageRecord& record, std::span<const uint8_t> page, const PagePlace& place,
              std::span<baked::ClusterRecord> clusters, std::span<uint8_t> payload);

private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

/// Whether a page's record is within its limits.
bool page_record_ok(const baked::PageRecord& record, PageCodec file_codec);

} // namespace packtrace
