#include "compress/format/page_decoder.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include <zstd.h>

#include "compress/format/page_cluster.h"
#include "compress/format/page_model.h"
#include "compress/format/page_readers.h"

namespace packtrace {
namespace {

/// The parts of a page that lie behind a table of their sizes.
class Parts {
public:
  explicit Parts(std::span<const uint8_t> bytes) : rest_(bytes) {}

  std::optional<uint32_t> number() {
    if (rest_.size() < sizeof(uint32_t)) return std::nullopt;
    uint32_t value = 0;
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_ = rest_.subspan(sizeof value);
    return value;
  }
  std::optional<std::span<const uint8_t>> take(size_t bytes) {
    if (bytes > rest_.size()) return std::nullopt;
    const auto part = rest_.first(bytes);
    rest_ = rest_.subspan(bytes);
    return part;
  }
  std::span<const uint8_t> rest() const { return rest_; }

private:
  std::span<const uint8_t> rest_;
};

bool unzip(ZSTD_DCtx* context, std::span<const uint8_t> from, std::span<uint8_t> to) {
  return ZSTD_decompressDCtx(context, to.data(), to.size(), from.data(), from.size()) == to.size();
}

} // namespace

struct PageDecoder::Scratch {
  SmallPageReader small;
  FastPageReader fast;
  PageModel<SmallPageReader> small_model{small};
  PageModel<FastPageReader> fast_model{fast};
  ClusterValues values;
  ClusterPacker packer;
  std::vector<uint8_t> bytes;
  std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> zstd{ZSTD_createDCtx(), &ZSTD_freeDCtx};

  /// Codec small: the size of the bit fields, these, and the words of the symbols.
  bool begin_small(std::span<const uint8_t> page) {
    Parts parts(page);
    const auto field_bytes = parts.number();
    if (!field_bytes) return false;
    const auto fields = parts.take(*field_bytes);
    if (!fields || parts.rest().size() < kReadSlackBytes) return false;
    small.begin(*fields, parts.rest());
    return true;
  }

  /// Codec fast: of the bit fields and of each stream of symbols the size and, where that is not 0, the size of its
  /// zstd frame, or 0 where it lies there as it is; then all of these.
  bool begin_fast(std::span<const uint8_t> page) {
    Parts parts(page);
    constexpr size_t kParts = 1 + kSymbolStreams;
    std::array<uint32_t, kParts> sizes{}, frames{};
    uint64_t total = 0;
    for (size_t i = 0; i < kParts; ++i) {
      const auto size = parts.number();
      if (!size || *size > baked::kMaxPagePayload * 4) return false;
      total += sizes[i] = *size;
      if (sizes[i] == 0) continue;
      const auto frame = parts.number();
      if (!frame) return false;
      frames[i] = *frame;
    }
    bytes.resize(total + kReadSlackBytes);
    std::array<std::span<const uint8_t>, kParts> streams;
    size_t at = 0;
    for (size_t i = 0; i < kParts; ++i) {
      const auto frame = parts.take(frames[i] == 0 ? sizes[i] : frames[i]);
      if (!frame) return false;
      const std::span<uint8_t> out(bytes.data() + at, sizes[i]);
      if (frames[i] == 0)
        std::copy(frame->begin(), frame->end(), out.begin());
      else if (!unzip(zstd.get(), *frame, out))
        return false;
      streams[i] = out;
      at += sizes[i];
    }
    if (!parts.rest().empty()) return false;
    std::array<std::span<const uint8_t>, kSymbolStreams> symbols;
    std::copy(streams.begin() + 1, streams.end(), symbols.begin());
    fast.begin(streams[0], symbols);
    return true;
  }

  bool decode_stored(std::span<const uint8_t> page, std::span<baked::ClusterRecord> clusters,
                     std::span<uint8_t> payload) {
    bytes.resize(clusters.size_bytes() + payload.size());
    if (!unzip(zstd.get(), page, bytes)) return false;
    std::memcpy(clusters.data(), bytes.data(), clusters.size_bytes());
    std::memcpy(payload.data(), bytes.data() + clusters.size_bytes(), payload.size());
    return true;
  }

  template <class Model>
  bool decode_clusters(Model& model, const PagePlace& place, std::span<baked::ClusterRecord> clusters,
                       std::span<uint8_t> payload) {
    model.begin();
    packer.begin(payload.size());
    const auto end_of = [](const baked::GeometryRecord& one) { return one.first_cluster + one.cluster_count; };
    const auto ended = [&](const baked::GeometryRecord& one) { return end_of(one) <= place.first_cluster; };
    auto g = static_cast<size_t>(
        std::partition_point(place.geometries.begin(), place.geometries.end(), ended) - place.geometries.begin());
    for (size_t i = 0; i < clusters.size(); ++i) {
      while (g < place.geometries.size() && end_of(place.geometries[g]) <= place.first_cluster + i) ++g;
      if (g == place.geometries.size()) return false;
      const baked::GeometryRecord& geometry = place.geometries[g];
      const uint64_t offset = place.payload_offset + packer.size();
      if (offset < geometry.payload_offset) return false;
      model.code_cluster(geometry, values);
      if (model.fault() || !packer.append(geometry, values, clusters[i])) return false;
      clusters[i].payload_offset = static_cast<uint32_t>((offset - geometry.payload_offset) / 4);
    }
    if (packer.size() != payload.size()) return false;
    std::memcpy(payload.data(), packer.data(), payload.size());
    return true;
  }
};

PageDecoder::PageDecoder() : scratch_(std::make_unique<Scratch>()) {}
PageDecoder::~PageDecoder() = default;

bool PageDecoder::decode(const baked::PageRecord& record, std::span<const uint8_t> page, const PagePlace& place,
                         std::span<baked::ClusterRecord> clusters, std::span<uint8_t> payload) {
  Scratch& s = *scratch_;
  switch (static_cast<PageCodec>(record.form)) {
  case PageCodec::kNone:
    return s.decode_stored(page, clusters, payload);
  case PageCodec::kFast:
    return s.begin_fast(page) && s.decode_clusters(s.fast_model, place, clusters, payload) && s.fast.whole();
  case PageCodec::kSmall:
    return s.begin_small(page) && s.decode_clusters(s.small_model, place, clusters, payload) && s.small.whole();
  }
  return false;
}

bool page_record_ok(const baked::PageRecord& record, PageCodec file_codec) {
  return record.payload_bytes > 0 && record.payload_bytes % 4 == 0 && record.payload_bytes <= baked::kMaxPagePayload &&
         record.cluster_count > 0 && record.cluster_count <= baked::kMaxPageClusters &&
         (record.form == static_cast<uint32_t>(PageCodec::kNone) || record.form == static_cast<uint32_t>(file_codec)) &&
         record.payload_bytes + record.cluster_count * sizeof(baked::ClusterRecord) <=
             baked::kMaxDiskRatio * record.disk_bytes;
}

} // namespace packtrace
