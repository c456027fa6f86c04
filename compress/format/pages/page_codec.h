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

/// How a file lies on disk. Opened, all three are the same bytes.
enum class PageCodec : uint32_t {
  kNone = 0, ///< as it is traced: mapped, nothing to decode
  kFast = 1, ///< predicted, then zstd over separate streams
  kSmall = 2 ///< predicted, then adaptive models
};

std::string_view name_of(PageCodec codec);
std::optional<PageCodec> find_page_codec(std::string_view name);

namespace baked {

/// How nodes lie in a file of codec fast or small.
enum NodeForm : uint32_t {
  kNodesWhole,   ///< as they are
  kNodesTopology ///< tree_topology.h: what the clusters do not say
};

/// What a file of codec fast or small begins with; magic, version and header_bytes lie as in FileHeader, whose size
/// differs. Then: the pages' records, head, tail, nodes, and the pages, without gaps.
struct PagedHeader {
  std::array<uint8_t, 8> magic;
  uint32_t version;
  uint32_t header_bytes;
  uint64_t file_bytes;
  uint32_t codec; ///< PageCodec
  uint32_t page_count;
  uint64_t resident_bytes;                         ///< of the file with codec none
  uint64_t head_bytes;                             ///< of that file before its cluster section
  uint64_t head_disk_bytes;                        ///< as one zstd frame
  uint64_t tail_bytes;                             ///< of that file behind its payload section up to its nodes
  uint64_t tail_disk_bytes;                        ///< as one zstd frame
  std::array<uint64_t, kPageStreams> stream_bytes; ///< of all pages; figures for people
  uint64_t node_count;                             ///< records of the node section, the last one
  uint64_t node_disk_bytes;                        ///< as one zstd frame; 0 without nodes
  uint32_t node_form;                              ///< NodeForm
  uint32_t reserved;
  std::array<uint64_t, 5> padding;
  uint64_t table_hash;  ///< XXH3-64 of the page records, head, tail and nodes
  uint64_t header_hash; ///< XXH3-64 of the header before this field
};
static_assert(std::is_trivially_copyable_v<PagedHeader> && sizeof(PagedHeader) == 192);
static_assert(offsetof(PagedHeader, codec) == 24 && offsetof(PagedHeader, resident_bytes) == 32 &&
              offsetof(PagedHeader, stream_bytes) == 72 && offsetof(PagedHeader, node_count) == 112 &&
              offsetof(PagedHeader, table_hash) == 176);

/// Consecutive clusters with their payload; clusters of one page may belong to several geometries.
struct PageRecord {
  uint64_t hash; ///< XXH3-64 of the page's bytes
  uint32_t disk_bytes;
  uint32_t payload_bytes; ///< resident, multiple of 4, 1 .. kMaxPagePayload
  uint32_t cluster_count; ///< 1 .. kMaxPageClusters
  uint32_t form;          ///< a codec; kNone: cluster records, then payload, as one zstd frame
};
static_assert(std::is_trivially_copyable_v<PageRecord> && sizeof(PageRecord) == 24);

inline constexpr uint32_t kPagePayload = 1u << 16;            ///< a page takes clusters up to this
inline constexpr uint32_t kMaxPagePayload = 2 * kPagePayload; ///< but one at least
inline constexpr uint32_t kMaxPageClusters = 2048;
/// What is said to be decoded from n bytes is at most this times n: no small file asks for much memory.
inline constexpr uint64_t kMaxDiskRatio = 1u << 15;

} // namespace baked

/// Sizes of a file as it lies on disk.
struct DiskForm {
  PageCodec codec = PageCodec::kNone;
  uint64_t file_bytes = 0;
  uint32_t page_count = 0;
  uint64_t table_bytes = 0; ///< header, page records, head and tail
  uint64_t node_bytes = 0;  ///< of trees
  std::array<uint64_t, kPageStreams> stream_bytes{};
  /// The nodes were restored, which relies on what validation checks of each cluster: find_cluster_fault() saw all
  /// clusters as they lie in the resident file's sections, and they were not written to since.
  bool clusters_checked = false;
};

/// Whether the bytes begin like a file of codec fast or small.
bool is_paged_file(std::span<const std::byte> bytes);

/// The file with codec none that a file of codec fast or small stands for; pages are decoded in parallel. The result is
/// not validated beyond what decoding needs: that is validate_baked_file()'s work.
/// Throws Error(kInput) where the file is damaged, Error(kUnsupported) for other versions.
std::vector<std::byte> expand_paged_file(std::span<const std::byte> bytes, const std::string& name, DiskForm& form);

} // namespace packtrace
