#include "compress/format/pages/page_decoder.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include <zstd.h>

#include "compress/format/pages/page_cluster.h"
#include "compress/format/pages/page_fast_decoder.h"
#include "compress/format/pages/page_model.h"
#include "compress/format/pages/page_readers.h"
#include "compress/format/pages/zstd_context.h"

namespace packtrace {
namespace {

/// Splits a page into consecutive parts.
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
  PageModel<SmallPageReader> model{small};
  FastPageReader fast;
  ClusterValues values;
  ClusterPacker packer;
  std::vector<uint8_t> bytes;
  ZstdDecoder zstd = make_zstd_decoder();

  /// Codec small: size of the bit fields (u32), the bit fields, then the words of the symbols.
  bool begin_small(std::span<const uint8_t> page) {
    Parts parts(page);
    const auto field_bytes = parts.number();
    if (!field_bytes) return false;
    const auto fields = parts.take(*field_bytes);
    if (!fields || parts.rest().size() < kReadSlackBytes) return false;
    small.begin(*fields, parts.rest());
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

  /// Decodes all clusters of a page.
  /// @param append writes the next cluster behind the earlier ones in `packed` and fills in its record; false if that
  /// fails
  template <class Packed, class Append>
  static bool decode_clusters(const Packed& packed, const Append& append, const PagePlace& place,
                              std::span<baked::ClusterRecord> clusters, std::span<uint8_t> payload) {
    const auto end_of = [](const baked::GeometryRecord& one) { return one.first_cluster + one.cluster_count; };
    const auto ended = [&](const baked::GeometryRecord& one) { return end_of(one) <= place.first_cluster; };
    auto g = static_cast<size_t>(std::partition_point(place.geometries.begin(), place.geometries.end(), ended) -
                                 place.geometries.begin());
    for (size_t i = 0; i < clusters.size(); ++i) {
      while (g < place.geometries.size() && end_of(place.geometries[g]) <= place.first_cluster + i) ++g;
      if (g == place.geometries.size()) return false;
      const baked::GeometryRecord& geometry = place.geometries[g];
      const uint64_t offset = place.payload_offset + packed.size();
      if (offset < geometry.payload_offset || !append(geometry, clusters[i])) return false;
      clusters[i].payload_offset = static_cast<uint32_t>((offset - geometry.payload_offset) / 4);
    }
    if (packed.size() != payload.size()) return false;
    std::memcpy(payload.data(), packed.data(), payload.size());
    return true;
  }

  bool decode_small(std::span<const uint8_t> page, const PagePlace& place, std::span<baked::ClusterRecord> clusters,
                    std::span<uint8_t> payload) {
    if (!begin_small(page)) return false;
    model.begin();
    packer.begin(payload.size());
    const auto append = [&](const baked::GeometryRecord& geometry, baked::ClusterRecord& record) {
      model.code_cluster(geometry, values);
      return !model.fault() && packer.append(geometry, values, record);
    };
    return decode_clusters(packer, append, place, clusters, payload) && small.whole();
  }

  bool decode_fast(std::span<const uint8_t> page, const PagePlace& place, std::span<baked::ClusterRecord> clusters,
                   std::span<uint8_t> payload) {
    if (!fast.begin(zstd.get(), page, static_cast<uint32_t>(clusters.size()), static_cast<uint32_t>(payload.size())))
      return false;
    const auto append = [&](const baked::GeometryRecord& geometry, baked::ClusterRecord& record) {
      return fast.append(geometry, record);
    };
    return decode_clusters(fast, append, place, clusters, payload) && fast.whole();
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
    return s.decode_fast(page, place, clusters, payload);
  case PageCodec::kSmall:
    return s.decode_small(page, place, clusters, payload);
  }
  return false;
}

bool page_record_ok(const baked::PageRecord& record, PageCodec file_codec) {
  // Files of codec small may have pages of codec fast.
  const bool known_form = record.form == static_cast<uint32_t>(PageCodec::kNone) ||
                          record.form == static_cast<uint32_t>(file_codec) ||
                          (file_codec == PageCodec::kSmall && record.form == static_cast<uint32_t>(PageCodec::kFast));
  return record.payload_bytes > 0 && record.payload_bytes % 4 == 0 && record.payload_bytes <= baked::kMaxPagePayload &&
         record.cluster_count > 0 && record.cluster_count <= baked::kMaxPageClusters && known_form &&
         record.payload_bytes + record.cluster_count * sizeof(baked::ClusterRecord) <=
             baked::kMaxDiskRatio * record.disk_bytes;
}

} // namespace packtrace
