#include "compress/format/pages/page_encoder.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <xxhash.h>
#include <zstd.h>

#include "compress/format/pages/page_cluster.h"
#include "compress/format/pages/page_decoder.h"
#include "compress/format/pages/page_fast_encoder.h"
#include "compress/format/pages/page_model.h"
#include "compress/format/pages/page_recorder.h"
#include "compress/format/pages/rans_writer.h"
#include "compress/format/pages/zstd_context.h"
#include "compress/format/trees/tree_topology.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

using Bytes = std::vector<uint8_t>;
using StreamBits = std::array<double, kPageStreams>;

constexpr int kZstdLevel = 19; // slow to compress, but decompresses as fast as other levels

Bytes zip(ZSTD_CCtx* context, std::span<const uint8_t> bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  const size_t size = ZSTD_compressCCtx(context, out.data(), out.size(), bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) throw Error(ErrorKind::kLimitExceeded, "zstd cannot compress a page");
  out.resize(size);
  return out;
}

void append(Bytes& to, std::span<const uint8_t> bytes) { to.insert(to.end(), bytes.begin(), bytes.end()); }

void append_number(Bytes& to, size_t value) {
  const auto number = static_cast<uint32_t>(value);
  append(to, {reinterpret_cast<const uint8_t*>(&number), sizeof number});
}

Bytes write_small(PageRecorder& recorder, StreamBits& bits) {
  std::array<NibbleModel, context::kCount> models;
  RansWriter writer(recorder.symbols().size());
  for (const auto& [context, second, value] : recorder.symbols())
    bits[static_cast<size_t>(page_stream_of(context))] += second == PageRecorder::kNoContext
                                                              ? writer.put(models[context], value)
                                                              : writer.put(models[context], models[second], value);
  Bytes page;
  append_number(page, recorder.fields().size());
  append(page, recorder.fields());
  append(page, writer.finish());
  return page;
}

/// A page's range of clusters and payload.
struct PageRange {
  uint64_t first_cluster, payload_offset;
  uint32_t cluster_count, payload_bytes;
};

struct EncodedPage {
  baked::PageRecord record{};
  Bytes bytes;
  std::array<uint64_t, kPageStreams> stream_bytes{};
};

class PageEncoder {
public:
  PageEncoder(const BakedSections& sections, PageCodec codec) : sections_(sections), codec_(codec) {}

  EncodedPage run(const PageRange& range) {
    EncodedPage page;
    page.record.payload_bytes = range.payload_bytes;
    page.record.cluster_count = range.cluster_count;
    StreamBits bits{};
    encode(page, range, bits);
    page.record.disk_bytes = static_cast<uint32_t>(page.bytes.size());
    if (!decodes_identically(page, range)) store(page, range, bits);
    page.record.hash = XXH3_64bits(page.bytes.data(), page.bytes.size());
    page.stream_bytes = whole_bytes(bits, page.bytes.size());
    return page;
  }

private:
  const baked::GeometryRecord& geometry_of(uint64_t cluster) const {
    const auto after = std::upper_bound(
        sections_.geometries.begin(), sections_.geometries.end(), cluster,
        [](uint64_t number, const baked::GeometryRecord& g) { return number < g.first_cluster + g.cluster_count; });
    return *after;
  }

  std::span<const baked::ClusterRecord> clusters(const PageRange& range) const {
    return sections_.clusters.subspan(static_cast<size_t>(range.first_cluster), range.cluster_count);
  }
  std::span<const uint8_t> payload(const PageRange& range) const {
    return sections_.payload.subspan(static_cast<size_t>(range.payload_offset), range.payload_bytes);
  }

  /// Codec small stores a page in the form of codec fast if that is smaller, as it is for grids with alternating
  /// diagonals.
  void encode(EncodedPage& page, const PageRange& range, StreamBits& bits) {
    page.record.form = static_cast<uint32_t>(PageCodec::kFast);
    page.bytes = encode_fast(range, bits);
    if (codec_ == PageCodec::kFast) return;
    StreamBits small_bits{};
    Bytes small = encode_small(range, small_bits);
    if (page.bytes.size() < small.size()) return;
    page.record.form = static_cast<uint32_t>(PageCodec::kSmall);
    page.bytes = std::move(small);
    bits = small_bits;
  }

  Bytes encode_small(const PageRange& range, StreamBits& bits) {
    PageRecorder recorder;
    PageModel<PageRecorder> model(recorder);
    model.begin();
    for (uint32_t i = 0; i < range.cluster_count; ++i) {
      const baked::GeometryRecord& geometry = geometry_of(range.first_cluster + i);
      unpack_cluster({geometry, clusters(range)[i], sections_.payload.data() + geometry.payload_offset}, *values_);
      model.code_cluster(geometry, *values_);
    }
    for (size_t i = 0; i < kPageStreams; ++i) bits[i] = static_cast<double>(recorder.field_bits()[i]);
    return write_small(recorder, bits);
  }

  Bytes encode_fast(const PageRange& range, StreamBits& bits) {
    FastPageWriter writer;
    for (uint32_t i = 0; i < range.cluster_count; ++i) {
      const baked::GeometryRecord& geometry = geometry_of(range.first_cluster + i);
      writer.add(geometry, clusters(range)[i], sections_.payload.data() + geometry.payload_offset);
    }
    return writer.finish(zstd_.get(), bits);
  }

  bool decodes_identically(const EncodedPage& page, const PageRange& range) {
    if (!page_record_ok(page.record, codec_)) return false;
    std::vector<baked::ClusterRecord> records(range.cluster_count);
    Bytes bytes(range.payload_bytes);
    if (!decoder_.decode(page.record, page.bytes, {sections_.geometries, range.first_cluster, range.payload_offset},
                         records, bytes))
      return false;
    for (size_t i = 0; i < records.size(); ++i) {
      baked::ClusterRecord expected = clusters(range)[i];
      expected.first_triangle = 0, expected.first_vertex = 0;
      if (std::memcmp(&expected, &records[i], sizeof expected) != 0) return false;
    }
    return std::ranges::equal(bytes, payload(range));
  }

  void store(EncodedPage& page, const PageRange& range, StreamBits& bits) {
    Bytes resident(range.cluster_count * sizeof(baked::ClusterRecord));
    std::memcpy(resident.data(), clusters(range).data(), resident.size());
    append(resident, payload(range));
    page.bytes = zip(zstd_.get(), resident);
    page.record.form = static_cast<uint32_t>(PageCodec::kNone);
    page.record.disk_bytes = static_cast<uint32_t>(page.bytes.size());
    bits = {};
    if (!page_record_ok(page.record, codec_))
      throw Error(ErrorKind::kLimitExceeded, "a page cannot be stored within the format's limits");
  }

  /// Bytes per stream. The rest, such as sizes and rounding remainders, counts as records.
  static std::array<uint64_t, kPageStreams> whole_bytes(const StreamBits& bits, uint64_t total) {
    std::array<uint64_t, kPageStreams> bytes{};
    uint64_t rest = total;
    for (size_t i = 0; i + 1 < kPageStreams; ++i) {
      bytes[i] = std::min(rest, static_cast<uint64_t>(bits[i] / 8.0));
      rest -= bytes[i];
    }
    bytes.back() = rest;
    return bytes;
  }

  const BakedSections& sections_;
  PageCodec codec_;
  std::unique_ptr<ClusterValues> values_ = std::make_unique<ClusterValues>();
  ZstdEncoder zstd_ = make_zstd_encoder();
  PageDecoder decoder_;
};

/// A cluster's payload ends where the next cluster's begins.
std::vector<PageRange> split_into_pages(const BakedSections& sections, PageCodec codec) {
  std::vector<PageRange> pages;
  for (const baked::GeometryRecord& g : sections.geometries)
    for (uint32_t i = 0; i < g.cluster_count; ++i) {
      const auto* record = &sections.clusters[static_cast<size_t>(g.first_cluster) + i];
      const uint64_t begin = uint64_t{4} * record->payload_offset;
      const uint64_t end = i + 1 < g.cluster_count ? uint64_t{4} * record[1].payload_offset : g.payload_bytes;
      const auto bytes = static_cast<uint32_t>(end - begin);
      if (pages.empty() || pages.back().payload_bytes + bytes > baked::page_payload(codec) ||
          pages.back().cluster_count == baked::kMaxPageClusters)
        pages.push_back({g.first_cluster + i, g.payload_offset + begin, 0, 0});
      ++pages.back().cluster_count;
      pages.back().payload_bytes += bytes;
    }
  return pages;
}

/// Returns the nodes' bytes on disk and their form. Nodes that do not follow from their topology are stored whole.
std::pair<Bytes, baked::NodeForm> encode_nodes(ZSTD_CCtx* zstd, const BakedSections& sections) {
  if (sections.nodes.empty()) return {{}, baked::kNodesWhole};
  const Bytes topology = pack_tree_topology(sections);
  std::vector<baked::PackedNode> restored(sections.nodes.size());
  if (restore_nodes(sections, topology, restored) &&
      std::memcmp(restored.data(), sections.nodes.data(), sections.nodes.size_bytes()) == 0)
    return {zip(zstd, topology), baked::kNodesTopology};
  return {zip(zstd, {reinterpret_cast<const uint8_t*>(sections.nodes.data()), sections.nodes.size_bytes()}),
          baked::kNodesWhole};
}

} // namespace

std::vector<std::byte> encode_paged_file(const BakedFile& file, PageCodec codec) {
  const BakedSections& sections = file.sections();
  const std::span<const std::byte> bytes = file.bytes();
  const std::vector<PageRange> ranges = split_into_pages(sections, codec);
  std::vector<EncodedPage> pages(ranges.size());
  tbb::enumerable_thread_specific<PageEncoder> encoders([&] { return PageEncoder(sections, codec); });
  tbb::parallel_for(size_t{0}, ranges.size(), [&](size_t i) { pages[i] = encoders.local().run(ranges[i]); });

  const auto* resident = reinterpret_cast<const uint8_t*>(bytes.data());
  const auto offset_of = [&](const void* section) {
    return static_cast<size_t>(static_cast<const uint8_t*>(section) - resident);
  };
  const size_t head_end = offset_of(sections.clusters.data());
  const size_t tail_begin = offset_of(sections.materials.data());
  const ZstdEncoder zstd = make_zstd_encoder();
  Bytes head = zip(zstd.get(), {resident, head_end});
  const size_t tail_end = offset_of(sections.rigid_motion.data()), motion_end = offset_of(sections.nodes.data());
  Bytes tail = zip(zstd.get(), {resident + tail_begin, tail_end - tail_begin});

  Bytes table;
  baked::PagedHeader header{};
  for (const EncodedPage& page : pages) {
    append(table, {reinterpret_cast<const uint8_t*>(&page.record), sizeof page.record});
    for (size_t i = 0; i < kPageStreams; ++i) header.stream_bytes[i] += page.stream_bytes[i];
    header.file_bytes += page.bytes.size();
  }
  const auto [nodes, node_form] = encode_nodes(zstd.get(), sections);
  append(table, head);
  append(table, tail);
  append(table, {resident + tail_end, motion_end - tail_end});
  append(table, nodes);
  header.magic = baked::kMagic;
  header.version = baked::kVersion;
  header.header_bytes = sizeof header;
  header.file_bytes += sizeof header + table.size();
  header.codec = static_cast<uint32_t>(codec);
  header.page_count = static_cast<uint32_t>(pages.size());
  header.resident_bytes = bytes.size();
  header.head_bytes = head_end, header.head_disk_bytes = head.size();
  header.tail_bytes = tail_end - tail_begin, header.tail_disk_bytes = tail.size();
  header.motion_bytes = motion_end - tail_end;
  header.node_count = sections.nodes.size(), header.node_disk_bytes = nodes.size(), header.node_form = node_form;
  header.table_hash = XXH3_64bits(table.data(), table.size());
  header.header_hash = XXH3_64bits(&header, offsetof(baked::PagedHeader, header_hash));

  std::vector<std::byte> out(static_cast<size_t>(header.file_bytes));
  std::memcpy(out.data(), &header, sizeof header);
  std::byte* at =
      std::copy_n(reinterpret_cast<const std::byte*>(table.data()), table.size(), out.data() + sizeof header);
  for (const EncodedPage& page : pages)
    at = std::copy_n(reinterpret_cast<const std::byte*>(page.bytes.data()), page.bytes.size(), at);
  return out;
}

} // namespace packtrace
