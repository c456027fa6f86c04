#include "compress/format/pages/page_codec.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <xxhash.h>
#include <zstd.h>

#include "compress/format/cluster/normal_codec.h"
#include "compress/format/cluster/position_grid.h"
#include "compress/format/cluster/uv_codec.h"
#include "compress/format/file/baked_file.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/pages/page_decoder.h"
#include "compress/format/trees/tree_topology.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/large_pages.h"

namespace packtrace {
namespace {

constexpr std::array<std::string_view, 3> kCodecNames{"none", "fast", "small"};

constexpr uint64_t align_up(uint64_t bytes) {
  return (bytes + baked::kSectionAlignment - 1) / baked::kSectionAlignment * baked::kSectionAlignment;
}

/// Expands one file. Each error names the file and the damaged part.
class Expander {
public:
  Expander(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  std::vector<std::byte> run(DiskForm& form) {
    check_header();
    read_table();
    compute_layout();
    reserve_large(resident_, static_cast<size_t>(header_.resident_bytes));
    resident_.resize(static_cast<size_t>(header_.resident_bytes));
    unzip(head_, 0, header_.head_bytes, "head");
    unzip(tail_, tail_begin_, header_.tail_bytes, "tail");
    std::copy(motion_.begin(), motion_.end(), resident_.begin() + static_cast<std::ptrdiff_t>(motion_begin_));
    check_head();
    decode_pages();
    set_first_triangles_and_vertices();
    decode_nodes();
    form = {static_cast<PageCodec>(header_.codec),
            bytes_.size(),
            header_.page_count,
            sizeof header_ + table_bytes() + head_.size() + tail_.size() + motion_.size(),
            nodes_.size(),
            header_.stream_bytes,
            clusters_checked_};
    return std::move(resident_);
  }

private:
  struct Place {
    uint64_t disk_offset, first_cluster, payload_offset;
  };

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorKind::kInput, name_ + ": damaged baked file: " + what);
  }

  uint64_t table_bytes() const { return uint64_t{header_.page_count} * sizeof(baked::PageRecord); }

  void check_header() {
    if (bytes_.size() < sizeof header_) fail("truncated header");
    std::memcpy(&header_, bytes_.data(), sizeof header_);
    if (header_.version != baked::kVersion)
      throw Error(ErrorKind::kUnsupported, name_ + ": baked file version " + std::to_string(header_.version) +
                                               ", this program reads version " + std::to_string(baked::kVersion));
    if (header_.header_hash != XXH3_64bits(bytes_.data(), offsetof(baked::PagedHeader, header_hash)))
      fail("header hash does not match");
    if (header_.file_bytes != bytes_.size())
      fail("it has " + std::to_string(bytes_.size()) + " bytes, its header says " + std::to_string(header_.file_bytes));
    if (header_.codec != static_cast<uint32_t>(PageCodec::kFast) &&
        header_.codec != static_cast<uint32_t>(PageCodec::kSmall))
      fail("codec");
    if (header_.node_form > baked::kNodesTopology) fail("node form");
    if (header_.reserved != 0 || header_.padding != decltype(header_.padding){}) fail("reserved header fields");
  }

  /// Reads the page records, and finds head, tail, motion, nodes and pages.
  void read_table() {
    uint64_t left = bytes_.size() - sizeof header_;
    for (const uint64_t part : {table_bytes(), header_.head_disk_bytes, header_.tail_disk_bytes, header_.motion_bytes,
                                header_.node_disk_bytes}) {
      if (part > left) fail("page table extent");
      left -= part;
    }
    const size_t end = bytes_.size() - static_cast<size_t>(left);
    if (header_.table_hash != XXH3_64bits(bytes_.data() + sizeof header_, end - sizeof header_))
      fail("page table hash does not match");
    const std::byte* at = bytes_.data() + sizeof header_;
    pages_.resize(header_.page_count);
    if (!pages_.empty()) std::memcpy(pages_.data(), at, static_cast<size_t>(table_bytes()));
    head_ = {at + table_bytes(), static_cast<size_t>(header_.head_disk_bytes)};
    tail_ = {head_.data() + head_.size(), static_cast<size_t>(header_.tail_disk_bytes)};
    motion_ = {tail_.data() + tail_.size(), static_cast<size_t>(header_.motion_bytes)};
    nodes_ = {motion_.data() + motion_.size(), static_cast<size_t>(header_.node_disk_bytes)};
    places_.reserve(pages_.size());
    uint64_t offset = end;
    for (size_t i = 0; i < pages_.size(); ++i) {
      if (!page_record_ok(pages_[i], static_cast<PageCodec>(header_.codec))) fail("page " + std::to_string(i));
      places_.push_back({offset, cluster_count_, payload_bytes_});
      offset += pages_[i].disk_bytes;
      cluster_count_ += pages_[i].cluster_count;
      payload_bytes_ += pages_[i].payload_bytes;
    }
    if (offset != bytes_.size()) fail("pages that do not fill the file");
  }

  /// Computes the layout of the resident file, which follows from the page records and the header.
  void compute_layout() {
    const auto ratio_ok = [](uint64_t bytes, uint64_t disk_bytes) {
      return bytes / baked::kMaxDiskRatio <= disk_bytes;
    };
    if (header_.head_bytes < sizeof(baked::FileHeader) || header_.head_bytes % baked::kSectionAlignment != 0 ||
        !ratio_ok(header_.head_bytes, header_.head_disk_bytes) ||
        !ratio_ok(header_.tail_bytes, header_.tail_disk_bytes))
      fail("head or tail size");
    payload_begin_ = align_up(header_.head_bytes + cluster_count_ * sizeof(baked::ClusterRecord));
    tail_begin_ = align_up(payload_begin_ + payload_bytes_ + kReadSlackBytes);
    motion_begin_ = tail_begin_ + header_.tail_bytes;
    nodes_begin_ = motion_begin_ + header_.motion_bytes;
    constexpr uint64_t kMaxNodes = uint64_t{1} << 40;
    if (header_.tail_bytes % baked::kSectionAlignment != 0 || header_.motion_bytes % baked::kSectionAlignment != 0 ||
        header_.node_count > kMaxNodes || (header_.node_count == 0) != nodes_.empty() ||
        !ratio_ok(node_bytes(), nodes_.size()))
      fail("tail, motion or node size");
    if (header_.resident_bytes != align_up(nodes_begin_ + node_bytes())) fail("resident size");
  }

  void unzip(std::span<const std::byte> from, uint64_t offset, uint64_t bytes, const char* what) {
    const size_t size =
        ZSTD_decompress(resident_.data() + offset, static_cast<size_t>(bytes), from.data(), from.size());
    if (ZSTD_isError(size) != 0 || size != bytes) fail(what);
  }

  /// Checks what decoding pages relies on; validation checks everything else.
  void check_head() {
    baked::FileHeader header;
    std::memcpy(&header, resident_.data(), sizeof header);
    if (header.version != header_.version) fail("head");
    const auto& [g_offset, g_bytes, g_record, g_reserved] = header.sections[baked::kGeometries];
    if (g_offset % baked::kSectionAlignment != 0 || g_offset > header_.head_bytes ||
        g_bytes > header_.head_bytes - g_offset)
      fail("geometry section");
    geometries_ = {reinterpret_cast<const baked::GeometryRecord*>(resident_.data() + g_offset),
                   static_cast<size_t>(g_bytes / sizeof(baked::GeometryRecord))};
    uint64_t clusters = 0, payload = 0;
    for (size_t i = 0; i < geometries_.size(); ++i) {
      const baked::GeometryRecord& g = geometries_[i];
      bool ok = g.first_cluster == clusters && g.payload_offset == payload &&
                g.payload_bytes <= payload_bytes_ - payload && g.cluster_count <= cluster_count_ - clusters &&
                g.anchor_shift <= 26 && g.step_mantissa >= kMinStepMantissa && g.step_mantissa <= kMaxStepMantissa &&
                g.step_exponent >= kMinStepExponent && g.step_exponent <= kMaxStepExponent &&
                g.normal_encoding < kNormalFormats.size() && g.uv_encoding < kUvEncodingNames.size();
      for (const int64_t o : g.origin) ok &= o >= -kMaxLattice && o <= kMaxLattice;
      if (!ok) fail("geometry " + std::to_string(i));
      clusters += g.cluster_count, payload += g.payload_bytes;
    }
    if (clusters != cluster_count_ || payload != payload_bytes_) fail("pages that belong to no geometry");
  }

  std::span<baked::ClusterRecord> clusters() {
    return {reinterpret_cast<baked::ClusterRecord*>(resident_.data() + header_.head_bytes),
            static_cast<size_t>(cluster_count_)};
  }

  bool decode_page(size_t i, PageDecoder& decoder) {
    const baked::PageRecord& page = pages_[i];
    const Place& place = places_[i];
    const std::span<const uint8_t> bytes(reinterpret_cast<const uint8_t*>(bytes_.data()) + place.disk_offset,
                                         page.disk_bytes);
    if (XXH3_64bits(bytes.data(), bytes.size()) != page.hash) return false;
    return decoder.decode(
        page, bytes, {geometries_, place.first_cluster, place.payload_offset},
        clusters().subspan(static_cast<size_t>(place.first_cluster), page.cluster_count),
        {reinterpret_cast<uint8_t*>(resident_.data()) + payload_begin_ + place.payload_offset, page.payload_bytes});
  }

  void decode_pages() {
    tbb::enumerable_thread_specific<PageDecoder> decoders;
    std::atomic<size_t> damaged{pages_.size()};
    tbb::parallel_for(size_t{0}, pages_.size(), [&](size_t i) {
      if (decode_page(i, decoders.local())) return;
      size_t first = damaged.load();
      while (i < first && !damaged.compare_exchange_weak(first, i)) {
      }
    });
    if (damaged.load() != pages_.size()) fail("page " + std::to_string(damaged.load()));
  }

  uint64_t node_bytes() const { return header_.node_count * sizeof(baked::PackedNode); }

  /// Section in the head or tail. Restoring nodes does not change it.
  template <typename T>
  std::span<const T> section(const baked::FileHeader& header, baked::Section number) const {
    const baked::SectionRecord& record = header.sections[number];
    if (record.offset % baked::kSectionAlignment != 0 || record.offset > nodes_begin_ ||
        record.bytes > nodes_begin_ - record.offset)
      fail("section " + std::to_string(number));
    return {reinterpret_cast<const T*>(resident_.data() + record.offset),
            static_cast<size_t>(record.bytes / sizeof(T))};
  }

  void decode_nodes() {
    if (header_.node_count == 0) return;
    if (header_.node_form == baked::kNodesWhole) {
      unzip(nodes_, nodes_begin_, node_bytes(), "nodes");
      return;
    }
    constexpr uint64_t kMaxBytes = 14; // per node: its kind, eight sizes, first triangle and cluster
    const uint64_t size = ZSTD_getFrameContentSize(nodes_.data(), nodes_.size());
    if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR || size > kMaxBytes * header_.node_count ||
        size / baked::kMaxDiskRatio > nodes_.size())
      fail("nodes");
    std::vector<uint8_t> topology(static_cast<size_t>(size));
    const size_t got = ZSTD_decompress(topology.data(), topology.size(), nodes_.data(), nodes_.size());
    baked::FileHeader header;
    std::memcpy(&header, resident_.data(), sizeof header);
    BakedSections sections;
    sections.geometries = geometries_;
    sections.clusters = clusters();
    sections.payload = {reinterpret_cast<const uint8_t*>(resident_.data()) + payload_begin_,
                        static_cast<size_t>(payload_bytes_) + kReadSlackBytes};
    sections.instances = section<baked::InstanceRecord>(header, baked::kInstances);
    sections.trees = section<baked::TreeRecord>(header, baked::kTrees);
    const std::span<baked::PackedNode> nodes{reinterpret_cast<baked::PackedNode*>(resident_.data() + nodes_begin_),
                                             static_cast<size_t>(header_.node_count)};
    if (ZSTD_isError(got) != 0 || got != size || !restore_nodes(sections, topology, nodes)) fail("nodes");
    // The header's section table is not validated yet, so check that its sections are those that were decoded above.
    const auto lies_at = [&](baked::Section number, uint64_t offset, uint64_t bytes) {
      return header.sections[number].offset == offset && header.sections[number].bytes == bytes;
    };
    clusters_checked_ = lies_at(baked::kClusters, header_.head_bytes, cluster_count_ * sizeof(baked::ClusterRecord)) &&
                        lies_at(baked::kPayload, payload_begin_, payload_bytes_ + kReadSlackBytes) &&
                        lies_at(baked::kNodes, nodes_begin_, node_bytes());
  }

  void set_first_triangles_and_vertices() {
    for (const baked::GeometryRecord& g : geometries_) {
      uint32_t triangles = 0, vertices = 0;
      for (baked::ClusterRecord& c : clusters().subspan(static_cast<size_t>(g.first_cluster), g.cluster_count)) {
        c.first_triangle = triangles, c.first_vertex = vertices;
        triangles += c.triangle_count, vertices += c.vertex_count;
      }
    }
  }

  std::span<const std::byte> bytes_;
  const std::string& name_;
  baked::PagedHeader header_{};
  std::vector<baked::PageRecord> pages_;
  std::vector<Place> places_;
  std::span<const std::byte> head_, tail_, motion_, nodes_;
  uint64_t cluster_count_ = 0, payload_bytes_ = 0, payload_begin_ = 0, tail_begin_ = 0, motion_begin_ = 0,
           nodes_begin_ = 0;
  bool clusters_checked_ = false;
  std::vector<std::byte> resident_;
  std::span<const baked::GeometryRecord> geometries_;
};

} // namespace

std::string_view name_of(PageCodec codec) { return kCodecNames[static_cast<size_t>(codec)]; }

std::optional<PageCodec> find_page_codec(std::string_view name) {
  const auto found = std::find(kCodecNames.begin(), kCodecNames.end(), name);
  if (found == kCodecNames.end()) return std::nullopt;
  return static_cast<PageCodec>(found - kCodecNames.begin());
}

bool is_paged_file(std::span<const std::byte> bytes) {
  constexpr size_t kAt = offsetof(baked::PagedHeader, header_bytes);
  static_assert(kAt == offsetof(baked::FileHeader, header_bytes) &&
                sizeof(baked::PagedHeader) != sizeof(baked::FileHeader));
  uint32_t header_bytes = 0;
  if (bytes.size() < kAt + sizeof header_bytes) return false;
  std::memcpy(&header_bytes, bytes.data() + kAt, sizeof header_bytes);
  return header_bytes == sizeof(baked::PagedHeader) &&
         std::memcmp(bytes.data(), baked::kMagic.data(), baked::kMagic.size()) == 0;
}

std::vector<std::byte> expand_paged_file(std::span<const std::byte> bytes, const std::string& name, DiskForm& form) {
  return Expander(bytes, name).run(form);
}

} // namespace packtrace
