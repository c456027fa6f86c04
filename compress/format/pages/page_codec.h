#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "compress/format/pages/page_contexts.h"

namespace packtrace {

/// Disk form of a file. All three expand to the same resident bytes.
enum class PageCodec : uint32_t {
  kNone = 0, ///< the resident form: mapped and traced without decoding
  kFast = 1, ///< prediction, then zstd over separate streams
  kSmall = 2 ///< prediction, then entropy coding with adaptive models
};

std::string_view name_of(PageCodec codec);
std::optional<PageCodec> find_page_codec(std::string_view name);

namespace baked {

/// Storage of tree nodes in a file with codec fast or small.
enum NodeForm : uint32_t {
  kNodesWhole,   ///< all node records
  kNodesTopology ///< tree_topology.h: only what does not follow from the clusters
};

/// Header of a file with codec fast or small. magic, version and header_bytes have the same places as in FileHeader,
/// but header_bytes has another value. Behind the header follow, without gaps: the page records, head, tail, motion,
/// nodes, and the pages.
struct PagedHeader {
  std::array<uint8_t, 8> magic;
  uint32_t version;
  uint32_t header_bytes;
  uint64_t file_bytes;
  uint32_t codec; ///< PageCodec
  uint32_t page_count;
  uint64_t resident_bytes;  ///< size of the resident file (codec none)
  uint64_t head_bytes;      ///< size of the part of that file before its cluster section
  uint64_t head_disk_bytes; ///< as one zstd frame
  /// Size of the part of that file behind its payload section, up to its motion.
  uint64_t tail_bytes;
  uint64_t tail_disk_bytes;                        ///< as one zstd frame
  std::array<uint64_t, kPageStreams> stream_bytes; ///< sums over all pages, for reports
  uint64_t node_count;                             ///< number of records in the node section
  uint64_t node_disk_bytes;                        ///< as one zstd frame; 0 without nodes
  uint32_t node_form;                              ///< NodeForm
  uint32_t reserved;
  uint64_t motion_bytes; ///< size of the part of that file from its motion sections to its nodes; as it is, on disk too
  std::array<uint64_t, 4> padding;
  uint64_t table_hash;  ///< XXH3-64 of the page records, head, tail, motion and nodes
  uint64_t header_hash; ///< XXH3-64 of the header before this field
};
static_assert(std::is_trivially_copyable_v<PagedHeader> && sizeof(PagedHeader) == 192);
static_assert(offsetof(PagedHeader, codec) == 24 && offsetof(PagedHeader, resident_bytes) == 32 &&
              offsetof(PagedHeader, stream_bytes) == 72 && offsetof(PagedHeader, node_count) == 112 &&
              offsetof(PagedHeader, motion_bytes) == 136 && offsetof(PagedHeader, table_hash) == 176);

/// Consecutive clusters with their payload. The clusters of one page may belong to several geometries.
struct PageRecord {
  uint64_t hash; ///< XXH3-64 of the page's bytes
  uint32_t disk_bytes;
  uint32_t payload_bytes; ///< resident, multiple of 4, 1 .. kMaxPagePayload
  uint32_t cluster_count; ///< 1 .. kMaxPageClusters
  uint32_t form;          ///< PageCodec; kNone: cluster records, then payload, as one zstd frame
};
static_assert(std::is_trivially_copyable_v<PageRecord> && sizeof(PageRecord) == 24);

/// Clusters are added to a page up to this size. Small pages learn more from longer pages.
constexpr uint32_t page_payload(PageCodec codec) { return codec == PageCodec::kSmall ? 1u << 17 : 1u << 16; }
inline constexpr uint32_t kMaxPagePayload = 1u << 18; ///< larger, because a page has at least one cluster
inline constexpr uint32_t kMaxPageClusters = 2048;
/// Limit of decoded bytes per byte on disk, so that a small file cannot request much memory.
inline constexpr uint64_t kMaxDiskRatio = 1u << 15;

} // namespace baked

/// Codec and sizes of a file on disk.
struct DiskForm {
  PageCodec codec = PageCodec::kNone;
  uint64_t file_bytes = 0;
  uint32_t page_count = 0;
  uint64_t table_bytes = 0; ///< header, page records, head, tail and motion
  uint64_t node_bytes = 0;  ///< nodes of all trees
  std::array<uint64_t, kPageStreams> stream_bytes{};
  /// True if nodes were restored from the clusters, which requires that find_cluster_fault() accepted every cluster.
  /// The check ran on the clusters at their places in the resident file, and they have not changed since.
  bool clusters_checked = false;
};

/// Whether the bytes begin with the header of a file with codec fast or small.
bool is_paged_file(std::span<const std::byte> bytes);

/// Expands a file with codec fast or small to its resident form. Pages are decoded in parallel. Validates only what
/// decoding needs; validate_baked_file() checks the rest.
/// Throws Error(kInput) if the file is damaged, Error(kUnsupported) for other versions.
std::vector<std::byte> expand_paged_file(std::span<const std::byte> bytes, const std::string& name, DiskForm& form);

} // namespace packtrace
