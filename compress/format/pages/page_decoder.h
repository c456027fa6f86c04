#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "compress/format/layout/baked_format.h"
#include "compress/format/pages/page_codec.h"

namespace packtrace {

/// The parts of a file that decoding a page needs.
struct PagePlace {
  /// Cluster and payload ranges without gaps; encodings and steps checked.
  std::span<const baked::GeometryRecord> geometries;
  uint64_t first_cluster = 0;  ///< first cluster of the page, in the cluster section
  uint64_t payload_offset = 0; ///< start of the page's payload, in the payload section
};

/// Decodes pages one after another and keeps its scratch memory. Use one decoder per thread.
class PageDecoder {
public:
  PageDecoder();
  ~PageDecoder();

  /// Decodes one page.
  /// @param page record.disk_bytes bytes; their hash is not checked
  /// @param clusters record.cluster_count records. first_triangle and first_vertex depend on the pages before, so they
  /// are left 0 unless record.form is kNone.
  /// @param payload record.payload_bytes bytes
  /// @return false if no encoder writes such bytes; the outputs are then unspecified
  bool decode(const baked::PageRecord& record, std::span<const uint8_t> page, const PagePlace& place,
              std::span<baked::ClusterRecord> clusters, std::span<uint8_t> payload);

private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

/// Whether the values of a page's record are within their limits.
bool page_record_ok(const baked::PageRecord& record, PageCodec file_codec);

} // namespace packtrace
