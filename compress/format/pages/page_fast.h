#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "compress/format/cluster/grid_block.h"
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
  kFields,  ///< bit fields
  kHeaders, ///< headers of all clusters, transposed: byte 0 of all headers first
  kBits,    ///< per cluster, each starting at a whole byte: turns, fresh corners, creases; of a grid its diagonals
  kRuns,    ///< triangle count of each strip
  kReusedVertices, ///< vertices of corners that are not fresh, and the originals of creases
  kResiduals,      ///< the byte above the low bits of each residual, in kClasses parts
  kParts = kResiduals + 4
};
inline constexpr uint32_t kClasses = kParts - kResiduals;

/// Channels of a vertex word, and their fields: positions x, y, z; normals y, x, chart, or the palette index; texture
/// coordinates u, v.
enum Channel : uint32_t { kPositions, kNormals, kUvs, kChannels };
inline constexpr uint32_t kChannelFields = 3; ///< maximum number of fields per channel

/// Borders of a grid cluster that it can share with an earlier one of the page.
enum GridBorder : uint32_t { kLeftColumn, kLowestRow, kGridBorders };
/// Flag: the diagonals of the grid are stored. Without it, they are those of the page's previous grid cluster, or all
/// 0.
inline constexpr uint8_t kGridDiagonals = 128;

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
  std::array<uint8_t, kChannels * kChannelFields - 1>
      coding; ///< per field: number of low bits, plus 64 times the class
  /// 0: the strips are stored. Else the cluster has the strips of a GridBlock with this number of columns; the rows
  /// follow from the number of triangles. May include kGridDiagonals.
  uint8_t grid;
  /// Distances to the earlier grid clusters whose right column is the left column here, and whose highest row is the
  /// lowest row here, counted in grid clusters of the page; 0: none.
  std::array<uint8_t, kGridBorders> neighbour;
  std::array<uint8_t, kGridBorders>
      shared; ///< bit c: the words of channel c on this border follow from the neighbour's
};
inline constexpr size_t kHeaderBytes = 48;
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

/// Returns the GridBlock of a grid cluster, with diagonals 0. Returns an empty block if its numbers of triangles and
/// vertices do not fit the columns.
inline GridBlock grid_size(uint8_t grid, uint32_t triangles, uint32_t vertices) {
  const uint32_t columns = grid & (kGridDiagonals - 1u);
  if (columns == 0 || triangles % (2 * columns) != 0) return {};
  const GridBlock block{columns, triangles / (2 * columns), 0};
  return block.point_count() == vertices ? block : GridBlock{};
}

/// Offsets of the fields of one channel of a cluster: coordinate = anchor + field.
using Anchors = std::array<uint64_t, kChannelFields>;

inline Anchors position_anchors(const baked::GeometryRecord& geometry, const baked::ClusterRecord& record) {
  Anchors anchors;
  for (size_t i = 0; i < anchors.size(); ++i)
    anchors[i] = static_cast<uint64_t>(geometry.origin[i]) +
                 (static_cast<uint64_t>(int64_t{record.anchor[i]}) << geometry.anchor_shift);
  return anchors;
}

/// Anchors of the fields of normal_layout(); 0 for indices of a palette.
inline Anchors normal_anchors(const baked::ClusterRecord& record) {
  if (record.normal_palette != 0) return {};
  return {static_cast<uint64_t>(int64_t{record.normal_anchor[1]} * 2),
          static_cast<uint64_t>(int64_t{record.normal_anchor[0]} * 2), 0};
}

/// Layout and anchors of one channel of one cluster.
struct ChannelFrame {
  Layout layout;
  Anchors anchors{};

  /// Whether moved_word() applies: both channels are present, have the same fields and are predicted.
  bool can_share(const ChannelFrame& other) const {
    return layout.field_count != 0 && layout.field_count == other.layout.field_count && !layout.verbatim() &&
           !other.layout.verbatim();
  }
};

inline uint64_t field_of(const Layout& layout, uint64_t word, uint32_t field) {
  uint32_t shift = 0;
  for (uint32_t i = 0; i < field; ++i) shift += layout.width[i];
  return (word >> shift) & ((uint64_t{1} << layout.width[field]) - 1);
}

/// Reads the frame of texture coordinates, which precedes their words in the bit stream.
inline ChannelFrame read_uv_frame(const uint8_t* bits, uint64_t at) {
  ChannelFrame frame{{2, {}}, {}};
  for (uint32_t i = 0; i < 2; ++i, at += kUvAnchorBits)
    frame.anchors[i] =
        static_cast<uint64_t>(int64_t{static_cast<int32_t>(static_cast<uint32_t>(read_bits(bits, at, kUvAnchorBits)))});
  for (uint32_t i = 0; i < 2; ++i, at += kUvWidthBits)
    frame.layout.width[i] = static_cast<uint32_t>(read_bits(bits, at, kUvWidthBits));
  return frame;
}

/// Returns the word in frame `to` with the coordinates that `word` has in frame `from`. A coordinate that does not fit
/// its field carries into the next one; the sum is modulo 2^64.
inline uint64_t moved_word(const ChannelFrame& from, uint64_t word, const ChannelFrame& to) {
  uint64_t moved = 0;
  for (uint32_t i = 0, shift = 0; i < to.layout.field_count; shift += to.layout.width[i], ++i)
    moved += (field_of(from.layout, word, i) + from.anchors[i] - to.anchors[i]) << shift;
  return moved;
}

inline constexpr uint64_t zigzag(int64_t value) {
  const auto shifted = static_cast<uint64_t>(value) << 1;
  return value < 0 ? ~shifted : shifted;
}
inline constexpr uint64_t unzigzag(uint64_t value) { return (value >> 1) ^ (0 - (value & 1u)); }

} // namespace packtrace::page_fast
