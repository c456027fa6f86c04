#include "compress/exchange/gltf/meshopt_streams.h"

#include <cstring>
#include <limits>
#include <string>

#include <meshoptimizer.h>

namespace packtrace {

namespace {

/// Sets the codec's versions, which are global. Streams of several threads are encoded at once.
void choose_versions() {
  static const bool chosen = [] {
    meshopt_encodeIndexVersion(1); // the only version of the extension
    meshopt_encodeVertexVersion(0);
    return true;
  }();
  static_cast<void>(chosen);
}

} // namespace

MeshoptStreams::Stream& MeshoptStreams::stream(const Format& format) {
  const auto [place, added] = streams_.try_emplace(format);
  if (added) place->second.view = model_.reserve_view();
  return place->second;
}

int MeshoptStreams::add(const Format& format, std::span<const std::byte> bytes, GltfJson accessor) {
  Stream& to = stream(format);
  accessor["bufferView"] = to.view;
  if (!to.bytes.empty()) accessor["byteOffset"] = to.bytes.size();
  accessor["count"] = bytes.size() / format.stride;
  to.bytes.insert(to.bytes.end(), bytes.begin(), bytes.end());
  return model_.add("accessors", std::move(accessor));
}

int MeshoptStreams::add_indices(const std::vector<uint32_t>& indices, size_t vertices) {
  const bool small = fits_short_indices(vertices);
  const uint32_t stride = small ? 2 : 4;
  Stream& to = stream({stride, kGltfIndices, {}, true});
  GltfJson accessor{{"bufferView", to.view},
                    {"componentType", small ? kGltfUnsignedShort : kGltfUnsignedInt},
                    {"count", indices.size()},
                    {"type", "SCALAR"}};
  if (!to.indices.empty()) accessor["byteOffset"] = to.indices.size() * stride;
  to.indices.insert(to.indices.end(), indices.begin(), indices.end());
  return model_.add("accessors", std::move(accessor));
}

int MeshoptStreams::add_strip(std::span<const std::array<uint32_t, 2>> strip, size_t vertices) {
  const bool small = fits_short_indices(vertices);
  GltfJson accessor{{"componentType", small ? kGltfUnsignedShort : kGltfUnsignedInt}, {"type", "SCALAR"}};
  std::vector<std::array<uint16_t, 2>> shorts;
  if (small)
    for (const auto& [left, right] : strip)
      shorts.push_back({static_cast<uint16_t>(left), static_cast<uint16_t>(right)});
  const int number = small ? add({4, kGltfIndices, {}}, std::as_bytes(std::span(shorts)), std::move(accessor))
                           : add({8, kGltfIndices, {}}, std::as_bytes(strip), std::move(accessor));
  model_.element("accessors", number)["count"] = 2 * strip.size();
  return number;
}

uint64_t MeshoptStreams::finish() {
  uint64_t total = 0;
  choose_versions();
  for (auto& [format, stream] : streams_) {
    const bool is_indices = format.list;
    const size_t count = is_indices ? stream.indices.size() : stream.bytes.size() / format.stride;
    std::vector<std::byte> coded(is_indices
                                     ? meshopt_encodeIndexBufferBound(count, std::numeric_limits<uint32_t>::max())
                                     : meshopt_encodeVertexBufferBound(count, format.stride));
    auto* const to = reinterpret_cast<unsigned char*>(coded.data());
    const size_t bytes = is_indices
                             ? meshopt_encodeIndexBuffer(to, coded.size(), stream.indices.data(), count)
                             : meshopt_encodeVertexBuffer(to, coded.size(), stream.bytes.data(), count, format.stride);
    coded.resize(bytes);
    model_.fill_compressed_view(
        stream.view, coded, format.target,
        {is_indices ? "TRIANGLES" : "ATTRIBUTES", std::string(format.filter), format.stride, count});
    total += bytes;
    stream = {};
  }
  streams_.clear();
  return total;
}

std::vector<std::byte> exponential(std::span<const int64_t> mantissas, int exponent) {
  std::vector<std::byte> bytes(mantissas.size() * sizeof(uint32_t));
  for (size_t i = 0; i < mantissas.size(); ++i) {
    const uint32_t word = (static_cast<uint32_t>(exponent) << 24) | (static_cast<uint32_t>(mantissas[i]) & 0xffffffu);
    std::memcpy(bytes.data() + i * sizeof word, &word, sizeof word);
  }
  return bytes;
}

} // namespace packtrace
