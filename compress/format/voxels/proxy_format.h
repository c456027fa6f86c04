#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

/// Proxies of a .ptk file: far or small stand-ins for geometries. They follow the shading in the section of texture
/// bytes, and 8 bytes with their size follow them. docs/voxels.md describes the streams.
namespace packtrace::voxels {

/// Bit of SummaryRecord::purpose: the file has proxies.
inline constexpr uint32_t kHasProxies = 1u << 16;
inline constexpr uint32_t kProxyVersion = 2;

enum ProxyKind : uint32_t { kVoxelProxy, kFieldProxy, kProxyKinds };

// ProxyRecord::flags
inline constexpr uint32_t kClosedSource = 1u << 0; ///< every edge of the geometry has an even number of triangles
inline constexpr uint32_t kFilled = 1u << 1;       ///< voxels inside are set, too
inline constexpr uint32_t kThin = 1u << 2;         ///< 6-separating; otherwise every voxel that the surface touches
inline constexpr uint32_t kSigned = 1u << 3;       ///< distances inside are negative
inline constexpr uint32_t kMatched =
    1u << 4; ///< voxels that block the same number of lines as the triangles; not with kThin
inline constexpr uint32_t kProxyFlags = kClosedSource | kFilled | kThin | kSigned | kMatched;

struct ProxyHeader {
  uint32_t version;
  uint32_t count; ///< of the records that follow
};

/// One geometry's proxy. Records are ordered by geometry; their data follow the last record, in order.
struct ProxyRecord {
  uint32_t geometry;
  uint32_t kind; ///< ProxyKind
  uint32_t flags;
  uint32_t palette_count;       ///< swatches, 4 bytes each (red, green, blue, zero), sRGB, at the end of the data
  std::array<double, 3> origin; ///< object space
  double edge;                  ///< of a voxel, object units
  double surface_error;         ///< largest distance from the surface to the nearest voxel's centre, measured
  double voxel_error;           ///< largest distance from a surface voxel's centre to the surface, measured
  uint64_t data_bytes;
};

static_assert(std::is_trivially_copyable_v<ProxyRecord> && sizeof(ProxyHeader) == 8 && sizeof(ProxyRecord) == 72 &&
              offsetof(ProxyRecord, origin) == 16 && offsetof(ProxyRecord, data_bytes) == 64);

} // namespace packtrace::voxels
