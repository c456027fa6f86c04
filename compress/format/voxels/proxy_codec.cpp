#include "compress/format/voxels/proxy_codec.h"

#include <cmath>
#include <cstring>

namespace packtrace {
namespace {

using namespace voxels;

template <class T>
void append_bytes(std::vector<uint8_t>& bytes, const T* first, size_t count) {
  const size_t at = bytes.size();
  bytes.resize(at + count * sizeof(T));
  if (count > 0) std::memcpy(bytes.data() + at, first, count * sizeof(T));
}

uint64_t data_bytes(const Proxy& proxy) {
  if (proxy.is_field()) return sizeof(FieldHeader) + 4 * proxy.field.words().size();
  return sizeof(OccupancyHeader) + 4 * (proxy.voxels.words().size() + proxy.palette.size());
}

/// Takes records from the front of a stream.
class StreamReader {
public:
  explicit StreamReader(std::span<const uint8_t> stream) : stream_(stream) {}

  template <class T>
  bool take(T* to, uint64_t count) {
    if (count > stream_.size() / sizeof(T)) return false;
    if (count > 0) std::memcpy(to, stream_.data(), static_cast<size_t>(count) * sizeof(T));
    stream_ = stream_.subspan(static_cast<size_t>(count) * sizeof(T));
    return true;
  }
  template <class T>
  bool take(std::vector<T>& to, uint64_t count) {
    if (count > stream_.size() / sizeof(T)) return false; // before it allocates
    to.resize(static_cast<size_t>(count));
    return take(to.data(), count);
  }
  std::span<const uint8_t> rest() const { return stream_; }

private:
  std::span<const uint8_t> stream_;
};

std::optional<std::string_view> record_fault(const ProxyRecord& r, uint64_t geometry_count) {
  if (r.geometry >= geometry_count) return "geometry";
  if (r.kind >= kProxyKinds) return "kind";
  constexpr uint32_t kTwoRules = voxels::kThin | voxels::kMatched;
  if ((r.flags & ~kProxyFlags) != 0 || (r.flags & kTwoRules) == kTwoRules) return "flags";
  for (const double o : r.origin)
    if (!std::isfinite(o)) return "origin";
  if (!(r.edge > 0.0) || !std::isfinite(r.edge * kMaxGridSize)) return "edge";
  for (const double error : {r.surface_error, r.voxel_error})
    if (!(error >= 0.0 && std::isfinite(error))) return "error";
  if (r.palette_count > kMaxSwatches) return "palette";
  return std::nullopt;
}

std::optional<std::string_view> take_voxels(StreamReader& reader, const ProxyRecord& record, Proxy& proxy) {
  OccupancyHeader header{};
  std::vector<uint32_t> words;
  if (!reader.take(&header, 1)) return "it ends in a header";
  if (header.palette_count != record.palette_count) return "palette";
  if (!reader.take(words, header.word_count)) return "it ends in the words";
  if (const auto fault = find_occupancy_fault(header, words)) return fault;
  if (!reader.take(proxy.palette, record.palette_count)) return "it ends in a palette";
  for (const uint32_t color : proxy.palette)
    if (color >> 24 != 0) return "colour";
  proxy.record = record;
  proxy.voxels = OccupancyStream(header, std::move(words));
  return std::nullopt;
}

std::optional<std::string_view> take_field(StreamReader& reader, const ProxyRecord& record, Proxy& proxy) {
  FieldHeader header{};
  std::vector<uint32_t> words;
  if (!reader.take(&header, 1)) return "it ends in a header";
  if (record.palette_count != 0) return "palette of a field";
  if (!reader.take(words, header.word_count)) return "it ends in the words";
  if (const auto fault = find_field_fault(header, words)) return fault;
  proxy.record = record;
  proxy.field = DistanceField(header, std::move(words));
  return std::nullopt;
}

/// Reads a stream and passes each proxy on: visit(Proxy&&).
template <class Visit>
std::optional<std::string_view> read_stream(std::span<const uint8_t> stream, uint64_t geometry_count,
                                            const Visit& visit) {
  StreamReader reader(stream);
  ProxyHeader header{};
  if (!reader.take(&header, 1)) return "it ends in its header";
  if (header.version != kProxyVersion) return "version, bake the file again";
  std::vector<ProxyRecord> records;
  if (!reader.take(records, header.count)) return "it ends in its records";
  for (size_t i = 0; i < records.size(); ++i) {
    if (const auto fault = record_fault(records[i], geometry_count)) return fault;
    if (i > 0 && records[i].geometry <= records[i - 1].geometry) return "order of geometries";
    const size_t before = reader.rest().size();
    Proxy proxy;
    if (const auto fault = records[i].kind == kFieldProxy ? take_field(reader, records[i], proxy)
                                                          : take_voxels(reader, records[i], proxy))
      return fault;
    if (before - reader.rest().size() != records[i].data_bytes) return "size of the data";
    visit(std::move(proxy));
  }
  if (!reader.rest().empty()) return "bytes behind the last proxy";
  return std::nullopt;
}

} // namespace

std::vector<uint8_t> encode_proxies(std::span<const Proxy> proxies) {
  std::vector<uint8_t> bytes;
  const ProxyHeader header{kProxyVersion, static_cast<uint32_t>(proxies.size())};
  append_bytes(bytes, &header, 1);
  for (const Proxy& proxy : proxies) {
    ProxyRecord record = proxy.record;
    record.data_bytes = data_bytes(proxy);
    record.palette_count = static_cast<uint32_t>(proxy.palette.size());
    append_bytes(bytes, &record, 1);
  }
  for (const Proxy& proxy : proxies) {
    if (proxy.is_field()) {
      append_bytes(bytes, &proxy.field.header(), 1);
      append_bytes(bytes, proxy.field.words().data(), proxy.field.words().size());
      continue;
    }
    append_bytes(bytes, &proxy.voxels.header(), 1);
    append_bytes(bytes, proxy.voxels.words().data(), proxy.voxels.words().size());
    append_bytes(bytes, proxy.palette.data(), proxy.palette.size());
  }
  return bytes;
}

std::vector<Proxy> read_proxies(std::span<const uint8_t> stream) {
  std::vector<Proxy> proxies;
  read_stream(stream, ~0ull, [&](Proxy&& proxy) { proxies.push_back(std::move(proxy)); });
  return proxies;
}

std::optional<std::string_view> find_proxy_fault(std::span<const uint8_t> stream, uint64_t geometry_count) {
  return read_stream(stream, geometry_count, [](Proxy&&) {});
}

} // namespace packtrace
