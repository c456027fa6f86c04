#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "compress/format/layout/baked_format.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/cluster/index_codec.h"
#include "compress/format/cluster/normal_codec.h"

/// The disk form of pages of codec `fast`; docs/baked_format.md says it in words. What both directions share.
///
/// All fields of a vertex lie in one 64-bit word as they lie in the cluster's bit stream. Sums and differences of such
/// words, as integers modulo 2^64, are those of the fields wherever the result's fields are in range: so a vertex is
/// predicted by one addition and one subtraction for all of its axes, and what is decoded is what the stream holds.
namespace packtrace::page_fast {

/// The parts of a page, in order.
enum Part : uint32_t {
  kFields,    ///< bit fields
  kHeaders,   ///< the bytes of all clusters' headers, byte 0 of all first
  kBits,      ///< per cluster, each from a whole byte on: turns, fresh corners, creases
  kRuns,      ///< triangles of each strip
  kOlds,      ///< vertices that corners name
  kResiduals, ///< low bytes of residuals, in kClasses parts
  kParts = kResiduals + 4
};
inline constexpr uint32_t kClasses = kParts - kResiduals;

/// Fields of a vertex, in channels: positions x, y, z; normals y, x, chart, or the palette entry; texture coordinates.
enum Channel : uint32_t { kPositions, kNormals, kUvs, kChannels };
inline constexpr uint32_t kChannelFields = 3; ///< at most

/// What is said of a cluster; differences are to the cluster before, as zigzag numbers.
struct Header {
  std::array<uint32_t, 3> anchor;         ///< difference
  uint32_t material_slot;                 ///< exclusive or with the last
  std::array<uint16_t, 2> normal_anchor;  ///< difference
  uint16_t palette;                       ///< as in the record
  uint8_t triangles;                      ///< less one
  uint8_t vertices;                       ///< less one
  uint8_t strips;                         ///< less one
  uint8_t flags;                          ///< as in the record
  uint8_t creases;                        ///< fresh vertices at the place of an older one of the cluster
  std::array<uint8_t, kChannels> escapes; ///< residuals with more than a byte above their low bits
  std::array<uint8_t, 3> position_bits;
  std::array<uint8_t, 2> normal_bits;
  std::array<uint8_t, kChannels * kChannelFields> coding; ///< of a field: low bits, and 64 times the class
};
inline constexpr size_t kHeaderBytes = 44;
static_assert(sizeof(Header) == kHeaderBytes && std::is_trivially_copyable_v<Header>);

inline constexpr uint32_t kLowBitsMask = 63, kClassShift = 6;
inline constexpr uint32_t kEscapeFieldBits = 2, kEscapeIndexBits = 8, kEscapeWidthBits = 6;
inline constexpr uint32_t kUvAnchorBits = 32, kUvWidthBits = 5;
inline constexpr uint32_t kByteBits = 8;

/// One channel of one cluster.
struct Layout {
  uint32_t field_count = 0;
  std::array<uint32_t, kChannelFields> width{};

  uint32_t stride() const { return width[0] + width[1] + width[2]; }
  /// Wider words than a stream field can be are stored as they are.
  bool verbatim() const { return stride() > kMaxFieldBits; }
};

inline Layout position_layout(const baked::ClusterRecord& record) {
  return {3, {record.position_bits[0], record.position_bits[1], record.position_bits[2]}};
}

/// Bits of a normal, or of a palette entry.
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
