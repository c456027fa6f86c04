#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "compress/format/voxels/distance_field.h"
#include "compress/format/voxels/occupancy_stream.h"
#include "compress/format/voxels/proxy_format.h"

namespace packtrace {

/// A simplified representation of a geometry.
struct Proxy {
  voxels::ProxyRecord record{};
  OccupancyStream voxels;        ///< kVoxelProxy
  std::vector<uint32_t> palette; ///< red in the lowest byte

  DistanceField field; ///< kFieldProxy

  bool is_field() const { return record.kind == packtrace::voxels::kFieldProxy; }
  /// Voxels, or the cells between the samples of a field.
  VoxelFrame frame() const {
    VoxelIndex size = is_field() ? field.size() : voxels.size();
    for (uint32_t& n : size) n -= is_field() ? 1 : 0;
    return {DVec3(record.origin[0], record.origin[1], record.origin[2]), record.edge, size};
  }
};

/// Encodes proxies, which must be ordered by geometry; data_bytes and palette_count of their records are set.
std::vector<uint8_t> encode_proxies(std::span<const Proxy> proxies);

/// Decodes a stream that find_proxy_fault() has accepted.
std::vector<Proxy> read_proxies(std::span<const uint8_t> stream);

/// Returns why a stream is damaged; nullopt if it is valid. Allocates no more than the stream holds.
/// @param geometry_count proxies belong to geometries below it
std::optional<std::string_view> find_proxy_fault(std::span<const uint8_t> stream, uint64_t geometry_count);

} // namespace packtrace
