#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compress/format/layout/payload_writer.h"
#include "compress/format/pages/page_fast_grid.h"
#include "compress/format/pages/page_fast_kernels.h"

struct ZSTD_DCtx_s;

namespace packtrace {

/// Decodes the clusters of a page with codec `fast` in order. Keeps its scratch memory for the next page.
class FastPageReader {
public:
  FastPageReader();
  ~FastPageReader();

  /// Begins a page and unpacks its parts.
  /// @param cluster_count 1 .. baked::kMaxPageClusters
  /// @param payload_bytes resident size of all clusters
  /// @return false if the parts do not match the page
  bool begin(ZSTD_DCtx_s* zstd, std::span<const uint8_t> page, uint32_t cluster_count, uint32_t payload_bytes);

  /// Decodes the next cluster: appends its streams to the payload and fills in its record, except payload_offset,
  /// first_triangle and first_vertex. Returns false if no encoder writes such data. For invalid data the result is
  /// unspecified, but all accesses stay within the decoder's memory.
  bool append(const baked::GeometryRecord& geometry, baked::ClusterRecord& record);

  /// Whether every byte of the page was used.
  bool whole() const;
  size_t size() const { return payload_.size(); }
  const uint8_t* data() const { return payload_.data(); }

private:
  struct Work;
  struct Cursor {
    const uint8_t* at = nullptr;
    const uint8_t* end = nullptr;

    /// Returns the next `count` bytes, or null if fewer are left.
    const uint8_t* take(size_t count) {
      if (count > static_cast<size_t>(end - at)) return nullptr;
      at += count;
      return at - count;
    }
  };

  bool take_bits(uint64_t count, uint64_t& first);
  page_fast::Header next_header();
  bool read_record(const page_fast::Header& header, baked::ClusterRecord& record);
  bool read_topology(const page_fast::Header& header, const IndexLayout& layout);
  bool read_grid(const page_fast::Header& header, const IndexLayout& layout);
  bool read_uv_layout(const baked::ClusterRecord& record);
  bool read_channels(const page_fast::Header& header, const baked::ClusterRecord& record);
  bool read_channel(uint32_t channel, const page_fast::Header& header, uint32_t vertex_count);
  bool read_escape(const page_fast::ChannelCode& code, uint32_t count, uint64_t* residuals);
  void walk_grid_channels();
  void put_bits(const uint8_t* bytes, uint64_t first, uint64_t count);
  void put_strips(const IndexLayout& layout);
  void put_cluster(const baked::ClusterRecord& record, const IndexLayout& layout);

  std::vector<uint8_t> bytes_; ///< all parts, decompressed
  std::array<Cursor, page_fast::kParts> parts_;
  uint64_t field_bit_ = 0, field_end_ = 0; ///< bit positions in part kFields
  uint32_t cluster_ = 0, cluster_count_ = 0;
  baked::ClusterRecord last_{};
  PayloadWriter payload_;
  page_fast::ResidualKernel read_residuals_ = page_fast::residual_kernel();
  std::unique_ptr<Work> work_;
};

} // namespace packtrace
