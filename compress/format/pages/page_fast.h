#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "compress/format/cluster/index_codec.h"
#include "compress/format/cluster/normal_codec.h"
#include "compress/format/cluster/uv_codec.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/layout/bit_stream.h"

/// Disk form of pages with codec `fast`; docs/baked_format.md describes it. This header has what encoder and decoder
/// share.
///
/// All fields of a vertex in one channel form a 64-bit word, with the same layout as in the cluster's bit stream.
/// Adding or subtracting two words as integers modulo 2^64 adds or subtracts all fields, provided that the fields of
/// the result are in range. So one addition and one subtraction predict all axes of a vertex, and decoding yields the
/// words of the stream.
namespace packtrace::page_fast {

/// The parts of a page, in order.
enum Part : uint32_t {
  kFields,         ///< bit fields
  kHeaders,        ///< headers of all clusters, transposed: byte 0 of all headers first
  kBits,           ///< per cluster, each starting at a whole byte: turns, fresh corners, creases
  kRuns,           ///< triangle count of each strip
  kReusedVertices, ///< vertices of corners that are not fresh, and the originals of creases
  kResiduals,      ///< the byte above the low bits of each residual, in kClasses parts
  kParts = kResiduals + 4
};
inline constexpr uint32_t kClasses = kParts - kResiduals;

/// Channels of a vertex word, and their fields: positions x, y, z; normals y, x, chart, or the palette index; texture
/// coordinates u, v.
enum Channel : uint32_t { kPositions, kNormals, kUvs, kChannels };
inline constexpr uint32_t kChannelFields = 3; ///< maximum number of fields per channel

/// Header of a cluster. Differences are zigzag numbers relative to the cluster before.
struct Header {
  std::array<uint32_t, 3> anchor;        ///< zigzag difference
  uint32_t material_slot;                ///< exclusive or with that of the cluster before
  std::array<uint16_t, 2> normal_anchor; ///< zigzag difference
  uint16_t palette;                      ///< as in the record
  uint8_t triangles;                     ///< minus one
  uint8_t vertices;                      ///< minus one
  uint8_t strips;                        ///< minus one
  uint8_t flags;                         ///< as in the record
  /// Number of fresh vertices at the position of an older vertex of the cluster.
  uint8_t creases;
  std::array<uint8_t, kChannels> escapes; ///< number of residuals whose value does not fit the low bits and one byte
  std::array<uint8_t, 3> position_bits;
  std::array<uint8_t, 2> normal_bits;
  std::array<uint8_t, kChannels * kChannelFields> coding; ///< per field: number of low bits, plus 64 times the class
};
inline constexpr size_t kHeaderBytes = 44;
static_assert(sizeof(Header) == kHeaderBytes && std::is_trivially_copyable_v<Header>);

inline constexpr uint32_t kLowBitsMask = 63, kClassShift = 6;
inline constexpr uint32_t kEscapeFieldBits = 2, kEscapeIndexBits = 8, kEscapeWidthBits = 6;
inline constexpr uint32_t kByteBits = 8;

/// Field widths of one channel of one cluster.
struct Layout {
  uint32_t field_count = 0;
  std::array<uint32_t, kChannelFields> width{};

  uint32_t stride() const { return width[0] + width[1] + width[2]; }
  /// Words wider than kMaxFieldBits are stored without prediction.
  bool verbatim() const { return stride() > kMaxFieldBits; }
};

inline Layout position_layout(const baked::ClusterRecord& record) {
  return {3, {record.position_bits[0], record.position_bits[1], record.position_bits[2]}};
}

/// Width of the chart in a normal or a palette entry.
inline uint32_t normal_chart_bits(const baked::GeometryRecord& geometry, const baked::ClusterRecord& record) {
  const auto encoding = static_cast<NormalEncoding>(geometry.normal_encoding);
  return (record.flags & baked::kClusterMixedCharts) != 0 ? bits_for_count(format_of(encoding).charts) : 0;
}

inline Layout normal_layout(const baked::GeometryRecord& geometry, const baked::ClusterRecord& record) {
  if ((record.flags & baked::kClusterHasNormals) == 0) return {};
  if (record.normal_palette != 0) return {1, {bits_for_count(record.normal_palette)}};
  return {3, {record.normal_bits[1], record.normal_bits[0], normal_chart_bits(geometry, record)}};
}

inline uint64_t field_of(const Layout& layout, uint64_t word, uint32_t field) {
  uint32_t shift = 0;
  for (uint32_t i = 0; i < field; ++i) shift += layout.width[i];
  return (word >> shift) & ((uint64_t{1} << layout.width[field]) - 1);
}

inline constexpr uint64_t zigzag(int64_t value) {
  const auto shifted = static_cast<uint64_t>(value) << 1;
  return value < 0 ? ~shifted : shifted;
}
inline constexpr uint64_t unzigzag(uint64_t value) { return (value >> 1) ^ (0 - (value & 1u)); }

} // namespace packtrace::page_fast
