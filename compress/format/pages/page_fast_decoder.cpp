#include "compress/format/pages/page_fast_decoder.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include <zstd.h>

#include "compress/format/pages/page_codec.h"
#include "compress/format/pages/page_fast_kernels.h"

namespace packtrace {

using namespace page_fast;

/// Data of the cluster that is being decoded.
struct FastPageReader::Work {
  GridBorders::Frames frames;
  /// Place of the bits that are copied: palettes; anchors and widths of texture coordinates.
  std::array<uint64_t, kChannels> prefix_bit{};
  std::array<uint32_t, kChannels> prefix_bits{};
  std::array<uint64_t, kChannels> verbatim_bit{}; ///< place of words without prediction
  const uint8_t* turns = nullptr;                 ///< bit array
  const uint8_t* fresh = nullptr;
  std::array<uint64_t, 3> restarts{}; ///< bit array; the last word is read, but never set
  WalkMemory::Words residuals{};      ///< residuals of positions, without gaps for creases
  WalkInput input;
  WalkMemory memory;

  bool is_grid = false; ///< the cluster has the strips of `block`, else they are stored
  GridBlock block;
  GridStrips strips; ///< of strips_block
  GridBlock strips_block;
  GridBorders borders;    ///< of the page
  uint64_t diagonals = 0; ///< of the page's last grid
  std::array<std::array<WalkMemory::Words, kGridBorders>, kChannels> shared_words;
  std::array<SharedBorders, kChannels> shared{};       ///< into shared_words
  std::array<WalkMemory::Words, kChannels> grid_words; ///< by grid point
};

FastPageReader::FastPageReader() : work_(std::make_unique<Work>()) {}
FastPageReader::~FastPageReader() = default;

bool FastPageReader::begin(ZSTD_DCtx_s* zstd, std::span<const uint8_t> page, uint32_t cluster_count,
                           uint32_t payload_bytes) {
  struct Place {
    uint32_t bytes, disk_bytes;
  };
  std::array<Place, kParts> places;
  if (page.size() < sizeof places) return false;
  std::memcpy(places.data(), page.data(), sizeof places);
  uint64_t total = 0, disk_total = sizeof places;
  for (const Place& place : places) {
    if (place.bytes > baked::kMaxPagePayload * 4 || place.disk_bytes > place.bytes) return false;
    total += place.bytes, disk_total += place.disk_bytes;
  }
  if (disk_total != page.size()) return false;
  if (bytes_.size() < total + kPartSlackBytes) bytes_.resize(total + kPartSlackBytes);
  uint8_t* to = bytes_.data();
  const uint8_t* from = page.data() + sizeof places;
  for (uint32_t i = 0; i < kParts; ++i) {
    const auto [bytes, disk_bytes] = places[i];
    if (disk_bytes == bytes)
      std::copy_n(from, bytes, to);
    else if (ZSTD_decompressDCtx(zstd, to, bytes, from, disk_bytes) != bytes)
      return false;
    parts_[i] = {to, to + bytes};
    to += bytes, from += disk_bytes;
  }
  std::memset(to, 0, kPartSlackBytes);
  if (places[kHeaders].bytes != cluster_count * kHeaderBytes) return false;
  field_bit_ = 0, field_end_ = 8 * uint64_t{places[kFields].bytes};
  cluster_ = 0, cluster_count_ = cluster_count;
  last_ = {};
  work_->borders.clear();
  work_->diagonals = 0;
  payload_.begin(payload_bytes);
  return true;
}

bool FastPageReader::take_bits(uint64_t count, uint64_t& first) {
  if (count > field_end_ - field_bit_) return false;
  first = field_bit_;
  field_bit_ += count;
  return true;
}

Header FastPageReader::next_header() {
  std::array<uint8_t, sizeof(Header)> row{};
  const uint8_t* column = parts_[kHeaders].at + cluster_;
  for (size_t i = 0; i < kHeaderBytes; ++i, column += cluster_count_) row[i] = *column;
  ++cluster_;
  Header header;
  std::memcpy(&header, row.data(), sizeof header);
  return header;
}

bool FastPageReader::read_record(const Header& header, baked::ClusterRecord& record) {
  record = {};
  record.material_slot = last_.material_slot ^ header.material_slot;
  for (size_t i = 0; i < 3; ++i)
    record.anchor[i] = static_cast<int32_t>(static_cast<uint32_t>(last_.anchor[i]) +
                                            static_cast<uint32_t>(unzigzag(header.anchor[i])));
  for (size_t i = 0; i < 2; ++i)
    record.normal_anchor[i] =
        static_cast<int16_t>(static_cast<uint64_t>(last_.normal_anchor[i]) + unzigzag(header.normal_anchor[i]));
  record.vertex_count = static_cast<uint16_t>(header.vertices + 1);
  record.normal_palette = header.palette;
  record.triangle_count = static_cast<uint8_t>(header.triangles + 1);
  record.strip_count = static_cast<uint8_t>(header.strips + 1);
  record.position_bits = header.position_bits;
  record.normal_bits = header.normal_bits;
  record.flags = header.flags;
  last_ = record;
  if (header.triangles >= kMaxClusterTriangles || header.strips > header.triangles) return false;
  for (const uint8_t bits : record.position_bits)
    if (bits > kMaxFieldBits) return false;
  for (const uint8_t bits : record.normal_bits)
    if (bits > 24) return false;
  return record.normal_palette <= record.vertex_count &&
         record.vertex_count <= record.triangle_count + 2u * record.strip_count;
}

bool FastPageReader::read_topology(const Header& header, const IndexLayout& layout) {
  Work& w = *work_;
  const uint32_t triangles = layout.triangle_count, corners = layout.corner_count(), vertices = layout.vertex_count;
  const auto bytes_of = [](uint32_t bits) { return (bits + 7) / 8; };
  w.turns = parts_[kBits].take(bytes_of(triangles));
  w.fresh = parts_[kBits].take(bytes_of(corners));
  const uint8_t* creases = parts_[kBits].take(header.creases != 0 ? bytes_of(vertices) : 0);
  const uint8_t* runs = parts_[kRuns].take(layout.strip_count);
  if (w.turns == nullptr || w.fresh == nullptr || creases == nullptr || runs == nullptr) return false;

  w.restarts = {};
  uint32_t first = 0;
  for (uint32_t i = 0; i < layout.strip_count; ++i) {
    if (runs[i] == 0 || first >= triangles) return false;
    w.restarts[first >> 6] |= uint64_t{1} << (first & 63u);
    first += runs[i];
  }
  if (first != triangles) return false;

  WalkMemory& m = w.memory;
  expand_bits(w.turns, triangles, m.left.data());
  if (expand_bits(w.fresh, corners, m.fresh.data()) != vertices) return false;
  if (header.creases != 0 && expand_bits(creases, vertices, m.crease.data()) != header.creases) return false;
  const uint32_t old_count = corners - vertices + header.creases;
  const uint8_t* reused_vertices = parts_[kReusedVertices].take(old_count);
  if (reused_vertices == nullptr) return false;
  sum_reused_vertices(reused_vertices, old_count, m.reused_vertices.data());
  w.input = {runs,
             layout.strip_count,
             {true, w.frames[kNormals].layout.field_count != 0, w.frames[kUvs].layout.field_count != 0},
             header.creases != 0};
  return true;
}

/// Finds the strips of a grid cluster, and the words that it shares with earlier ones.
bool FastPageReader::read_grid(const Header& header, const IndexLayout& layout) {
  Work& w = *work_;
  w.block = grid_size(header.grid, layout.triangle_count, layout.vertex_count);
  if (w.block.columns == 0 || header.creases != 0) return false;
  if ((header.grid & kGridDiagonals) != 0) {
    const uint8_t* diagonals = parts_[kBits].take((w.block.quad_count() + 7) / 8);
    if (diagonals == nullptr) return false;
    w.diagonals = 0;
    for (uint32_t i = 0; i < w.block.quad_count(); i += 8) w.diagonals |= uint64_t{diagonals[i / 8]} << i;
  }
  w.block.diagonals = w.diagonals;
  if (w.block != w.strips_block) find_grid_strips(w.block, w.strips);
  w.strips_block = w.block;
  if (w.strips.layout.strip_count != layout.strip_count) return false;
  w.input = {};
  w.input.has = {true, w.frames[kNormals].layout.field_count != 0, w.frames[kUvs].layout.field_count != 0};
  w.shared = {};
  for (const GridBorder border : {kLeftColumn, kLowestRow})
    for (const Channel channel : {kPositions, kNormals, kUvs}) {
      if ((header.shared[border] >> channel & 1u) == 0) continue;
      WalkMemory::Words& words = w.shared_words[channel][border];
      if (!w.borders.share(border, header.neighbour[border], channel, w.block, w.frames[channel], words.data()))
        return false;
      w.shared[channel][border] = words.data();
    }
  return true;
}

bool FastPageReader::read_uv_layout(const baked::ClusterRecord& record) {
  Work& w = *work_;
  w.frames[kUvs] = {};
  w.prefix_bits[kUvs] = 0;
  if ((record.flags & baked::kClusterHasUvs) == 0) return true;
  w.prefix_bits[kUvs] = kUvHeaderBits;
  if (!take_bits(w.prefix_bits[kUvs], w.prefix_bit[kUvs])) return false;
  w.frames[kUvs] = read_uv_frame(parts_[kFields].at, w.prefix_bit[kUvs]);
  return true;
}

bool FastPageReader::read_channel(uint32_t channel, const Header& header, uint32_t vertex_count) {
  Work& w = *work_;
  const Layout& layout = w.frames[channel].layout;
  const uint8_t* bits = parts_[kFields].at;
  const uint8_t creases = channel == kPositions ? header.creases : 0;
  uint64_t* residuals = creases != 0 ? w.residuals.data() : w.memory.residuals[channel].data();
  if (creases >= vertex_count) return false;
  const SharedBorders shared = w.is_grid ? w.shared[channel] : SharedBorders{};
  const bool has_first = shared == SharedBorders{};
  const uint32_t count = has_first
                             ? vertex_count - 1 - creases
                             : count_unshared(w.block, shared[kLeftColumn] != nullptr, shared[kLowestRow] != nullptr);
  if (layout.verbatim()) {
    std::fill_n(residuals, vertex_count, uint64_t{0});
    return creases == 0 && take_bits(uint64_t{layout.stride()} * vertex_count, w.verbatim_bit[channel]);
  }
  if (has_first) {
    uint64_t first = 0;
    if (!take_bits(layout.stride(), first)) return false;
    *residuals++ = read_bits(bits, first, layout.stride());
  }
  ChannelCode code{layout.field_count, {}, bits, 0, 0};
  for (uint32_t i = 0, shift = 0; i < layout.field_count; shift += layout.width[i], ++i) {
    const uint32_t coding = header.coding[channel * kChannelFields + i], low_bits = coding & kLowBitsMask;
    code.fields[i] = {parts_[kResiduals + (coding >> kClassShift)].take(count), low_bits, code.low_stride, shift};
    code.low_stride += low_bits;
    if (code.fields[i].bytes == nullptr || code.low_stride > kMaxFieldBits) return false;
  }
  if (!take_bits(uint64_t{count} * code.low_stride, code.low_bit)) return false;
  read_residuals_(code, count, residuals);
  for (uint32_t i = 0; i < header.escapes[channel]; ++i)
    if (!read_escape(code, count, residuals)) return false;
  if (creases != 0)
    expand_residuals(w.residuals.data(), w.memory.crease.data(), vertex_count, w.memory.residuals[channel].data());
  return true;
}

/// Adds a residual whose high part is wider than a byte.
bool FastPageReader::read_escape(const ChannelCode& code, uint32_t count, uint64_t* residuals) {
  const uint8_t* bits = parts_[kFields].at;
  uint64_t at = 0;
  const auto take = [&](uint32_t width) {
    at += width;
    return static_cast<uint32_t>(read_bits(bits, at - width, width));
  };
  if (!take_bits(kEscapeFieldBits + kEscapeIndexBits + kEscapeWidthBits, at)) return false;
  const uint32_t number = take(kEscapeFieldBits), index = take(kEscapeIndexBits), width = take(kEscapeWidthBits);
  if (number >= code.field_count || index >= count || width > kMaxFieldBits || !take_bits(width, at)) return false;
  const FieldCode& field = code.fields[number];
  const uint64_t low = code.low_of(index);
  residuals[index] +=
      residual_word(field, read_bits(bits, at, width), low) - residual_word(field, field.bytes[index], low);
  return true;
}

bool FastPageReader::read_channels(const Header& header, const baked::ClusterRecord& record) {
  Work& w = *work_;
  if (!take_bits(w.prefix_bits[kNormals], w.prefix_bit[kNormals])) return false;
  for (uint32_t channel = 0; channel < kChannels; ++channel)
    if (w.input.has[channel] && !read_channel(channel, header, record.vertex_count)) return false;
  return true;
}

void FastPageReader::put_bits(const uint8_t* bytes, uint64_t first, uint64_t count) {
  for (; count > kMaxFieldBits; first += kMaxFieldBits, count -= kMaxFieldBits)
    payload_.put(read_bits(bytes, first, kMaxFieldBits), kMaxFieldBits);
  payload_.put(read_bits(bytes, first, static_cast<uint32_t>(count)), static_cast<uint32_t>(count));
}

void FastPageReader::put_strips(const IndexLayout& layout) {
  const Work& w = *work_;
  const auto bytes_of = [](const auto& words) { return reinterpret_cast<const uint8_t*>(words.data()); };
  put_bits(bytes_of(w.is_grid ? w.strips.restart : w.restarts), 0, layout.triangle_count);
  put_bits(w.is_grid ? bytes_of(w.strips.left) : w.turns, 0, layout.triangle_count);
  put_bits(w.is_grid ? bytes_of(w.strips.fresh) : w.fresh, 0, layout.corner_count());
  const uint32_t width = layout.index_bits();
  const uint8_t* explicits = w.is_grid ? w.strips.explicits.data() : w.memory.explicits.data();
  const uint32_t count = layout.corner_count() - layout.vertex_count, index_mask = (1u << width) - 1;
  payload_.put_each(count / 4, 4 * width, [&](uint32_t i) { return pack_four(explicits + size_t{4} * i, width); });
  payload_.put_each(count % 4, width, [&](uint32_t i) { return explicits[count / 4 * 4 + i] & index_mask; });
}

void FastPageReader::put_cluster(const baked::ClusterRecord& record, const IndexLayout& layout) {
  const Work& w = *work_;
  put_strips(layout);
  for (uint32_t channel = 0; channel < kChannels; ++channel) {
    const Layout& one = w.frames[channel].layout;
    if (one.field_count == 0) continue;
    if (channel != kPositions) put_bits(parts_[kFields].at, w.prefix_bit[channel], w.prefix_bits[channel]);
    if (one.verbatim()) {
      put_bits(parts_[kFields].at, w.verbatim_bit[channel], uint64_t{one.stride()} * record.vertex_count);
      continue;
    }
    const uint32_t stride = one.stride();
    const uint64_t mask = (uint64_t{1} << stride) - 1;
    const uint64_t* words = w.memory.words[channel].data();
    payload_.put_each(record.vertex_count, stride, [&](uint32_t v) { return words[v] & mask; });
  }
}

/// Reconstructs the words of a grid cluster.
void FastPageReader::walk_grid_channels() {
  Work& w = *work_;
  std::array<const uint64_t*, kChannels> words{};
  for (uint32_t channel = 0; channel < kChannels; ++channel) {
    if (!w.input.has[channel] || w.frames[channel].layout.verbatim()) continue;
    uint64_t* by_point = w.grid_words[channel].data();
    walk_grid(w.block, w.shared[channel], w.memory.residuals[channel].data(), by_point);
    for (uint32_t point = 0; point < w.block.point_count(); ++point)
      w.memory.words[channel][w.strips.vertex_of_point[point]] = by_point[point];
    words[channel] = by_point;
  }
  w.borders.add(w.block, w.frames, words);
}

bool FastPageReader::append(const baked::GeometryRecord& geometry, baked::ClusterRecord& record) {
  Work& w = *work_;
  const Header header = next_header();
  if (!read_record(header, record)) return false;
  const IndexLayout layout{record.triangle_count, record.vertex_count, record.strip_count};
  w.frames[kPositions] = {position_layout(record), position_anchors(geometry, record)};
  w.frames[kNormals] = {normal_layout(geometry, record), normal_anchors(record)};
  if (record.normal_palette != 0 && w.frames[kNormals].layout.field_count == 0) return false;
  w.prefix_bits[kNormals] = record.normal_palette * (uint32_t{record.normal_bits[0]} + record.normal_bits[1] +
                                                     normal_chart_bits(geometry, record));
  if (!read_uv_layout(record)) return false;
  w.is_grid = header.grid != 0;
  if (!(w.is_grid ? read_grid(header, layout) : read_topology(header, layout))) return false;
  if (!read_channels(header, record)) return false;
  if (w.is_grid)
    walk_grid_channels();
  else
    walk_strips(w.input, w.memory);

  uint64_t bits = layout.total_bits();
  for (uint32_t channel = 0; channel < kChannels; ++channel)
    if (w.frames[channel].layout.field_count != 0)
      bits += uint64_t{w.frames[channel].layout.stride()} * record.vertex_count +
              (channel == kPositions ? 0 : w.prefix_bits[channel]);
  if (!payload_.begin_cluster(bits)) return false;
  put_cluster(record, layout);
  return true;
}

bool FastPageReader::whole() const {
  for (uint32_t i = 0; i < kParts; ++i)
    if (i != kFields && i != kHeaders && parts_[i].at != parts_[i].end) return false;
  return cluster_ == cluster_count_ && field_end_ - field_bit_ < 8;
}

} // namespace packtrace
