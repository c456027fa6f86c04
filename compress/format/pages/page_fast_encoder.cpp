#include "compress/format/pages/page_fast_encoder.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>

#include <zstd.h>

#include "pbrt_import/base/error.h"

namespace packtrace {

using namespace page_fast;

namespace {

constexpr uint32_t kByteMask = (1u << kByteBits) - 1;
constexpr int32_t kNoVertex = -1;
static_assert(kNoVertex == kNoPoint);
constexpr uint32_t kMaxEscapes = 255, kMaxCreases = 255;
constexpr size_t kMaxNeighbour = 255;
constexpr size_t kRepetitive =
    8; ///< parts that shrink to less than 1 / kRepetitive are compressed again, with more effort
constexpr std::array<PageStream, kChannels> kStreamOf{PageStream::kPositions, PageStream::kNormals, PageStream::kUvs};

void put_bytes(std::vector<uint8_t>& to, const BitWriter& writer) {
  to.insert(to.end(), writer.bytes().begin(), writer.bytes().end());
}

/// Counts the residuals that have more than eight bits above low_bits.
uint32_t count_escapes(std::span<const uint64_t> residuals, uint32_t low_bits) {
  return static_cast<uint32_t>(
      std::ranges::count_if(residuals, [&](uint64_t r) { return (r >> low_bits) > kByteMask; }));
}

/// Chooses the number of low bits. Residuals below 2^low_bits waste bits; residuals that exceed the byte above them
/// cost an escape.
uint32_t choose_low_bits(std::span<const uint64_t> residuals, uint32_t max_escapes) {
  constexpr uint64_t kEscapeCost = 30;
  uint32_t best = 0;
  uint64_t least = ~uint64_t{0};
  for (uint32_t low_bits = 0; low_bits <= kMaxFieldBits - kByteBits; ++low_bits) {
    if (count_escapes(residuals, low_bits) > max_escapes) continue;
    uint64_t cost = 0;
    for (const uint64_t r : residuals)
      cost += (r >> low_bits) > kByteMask ? kEscapeCost + low_bits
                                          : std::max(static_cast<uint32_t>(std::bit_width(r)), low_bits);
    if (cost < least) least = cost, best = low_bits;
  }
  return best;
}

std::vector<uint8_t> zip(ZSTD_CCtx* zstd, const std::vector<uint8_t>& bytes) {
  std::vector<uint8_t> out(ZSTD_compressBound(bytes.size()));
  const size_t size = ZSTD_compress2(zstd, out.data(), out.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0) throw Error(ErrorKind::kLimitExceeded, "zstd cannot compress a page");
  out.resize(size);
  return out;
}

/// Compresses to a zstd frame with hardly anything but Huffman codes, which decodes fastest; shorter matches would make
/// pages only 0.3 % smaller. Highly repetitive parts, such as those of grids, get zstd's level 19. Returns the bytes
/// unchanged if that saves less than 5 %.
std::vector<uint8_t> zip_part(ZSTD_CCtx* zstd, const std::vector<uint8_t>& bytes) {
  if (bytes.empty()) return {};
  ZSTD_CCtx_reset(zstd, ZSTD_reset_session_and_parameters);
  ZSTD_CCtx_setParameter(zstd, ZSTD_c_compressionLevel, 1);
  ZSTD_CCtx_setParameter(zstd, ZSTD_c_strategy, ZSTD_fast);
  ZSTD_CCtx_setParameter(zstd, ZSTD_c_minMatch, 7);
  std::vector<uint8_t> out = zip(zstd, bytes);
  if (out.size() * kRepetitive < bytes.size()) {
    ZSTD_CCtx_reset(zstd, ZSTD_reset_session_and_parameters);
    ZSTD_CCtx_setParameter(zstd, ZSTD_c_compressionLevel, 19);
    std::vector<uint8_t> smaller = zip(zstd, bytes);
    if (smaller.size() < out.size()) return smaller;
  }
  return out.size() * 20 < bytes.size() * 19 ? out : bytes;
}

/// Classifies residuals by the mean number of bits in their bytes.
uint32_t class_of(std::span<const uint64_t> residuals, uint32_t low_bits) {
  uint64_t bits = 0;
  for (const uint64_t r : residuals)
    bits += (r >> low_bits) > kByteMask ? 0 : static_cast<uint64_t>(std::bit_width(r >> low_bits));
  const uint64_t halves = 2 * bits / std::max<uint64_t>(residuals.size(), 1);
  return halves < 4 ? 0 : halves < 7 ? 1 : halves < 10 ? 2 : 3;
}

} // namespace

void FastPageWriter::put(Channel channel, uint64_t value, uint32_t bits) {
  fields_.put(value, bits);
  field_bits_[static_cast<size_t>(kStreamOf[channel])] += bits;
}

void FastPageWriter::add(const baked::GeometryRecord& geometry, const baked::ClusterRecord& record,
                         const uint8_t* payload) {
  const ClusterView view(geometry, record, payload);
  geometry_ = &geometry;
  header_ = {};
  for (std::vector<uint64_t>& residuals : residuals_) residuals.clear();
  last_reused_ = 0;
  read_vertices(view);
  find_creases(view);
  unpack_cluster(view, *values_);
  is_grid_ = find_grid();
  if (is_grid_)
    add_grid(view);
  else
    add_topology();
  add_fields(view);
  add_header(record);
}

/// Reads the words of each vertex as they are in the cluster's streams.
void FastPageWriter::read_vertices(const ClusterView& view) {
  const baked::ClusterRecord& record = view.record();
  frames_ = {ChannelFrame{position_layout(record), position_anchors(*geometry_, record)},
             ChannelFrame{normal_layout(*geometry_, record), normal_anchors(record)}, ChannelFrame{}};
  const ClusterView::StreamBits stream = view.stream_bits();
  const uint64_t normal_bit = stream.indices + stream.positions, uv_bit = normal_bit + stream.normals;
  const uint64_t vertex_count = record.vertex_count;
  prefix_bit_ = {stream.indices, normal_bit, uv_bit}, prefix_bits_ = {};
  prefix_bits_[kNormals] = stream.normals - vertex_count * frames_[kNormals].layout.stride();
  if (view.has_uvs()) {
    frames_[kUvs] = read_uv_frame(view.bits(), uv_bit);
    prefix_bits_[kUvs] = kUvHeaderBits;
  }
  vertices_.assign(static_cast<size_t>(vertex_count), {});
  for (uint32_t channel = 0; channel < kChannels; ++channel) {
    const uint32_t stride = frames_[channel].layout.stride();
    if (frames_[channel].layout.verbatim()) continue;
    uint64_t at = prefix_bit_[channel] + prefix_bits_[channel];
    for (Vertex& vertex : vertices_) {
      vertex.words[channel] = read_bits(view.bits(), at, stride);
      at += stride;
    }
  }
}

/// Finds creases: fresh vertices at the position of an earlier one, typically with another normal.
void FastPageWriter::find_creases(const ClusterView& view) {
  if (frames_[kPositions].layout.verbatim()) return;
  std::map<LatticePoint, uint32_t> places;
  uint32_t count = 0;
  for (uint32_t v = 0; v < vertices_.size(); ++v) {
    const auto [place, is_new] = places.try_emplace(view.lattice(v), v);
    if (!is_new && count < kMaxCreases) {
      vertices_[v].is_crease = true;
      vertices_[v].original = place->second;
      ++count;
    }
    place->second = v;
  }
  // If there are only a few, one bit per vertex costs more than they save.
  if (count * 16 < vertices_.size()) {
    for (Vertex& vertex : vertices_) vertex.is_crease = false;
    count = 0;
  }
  header_.creases = static_cast<uint8_t>(count);
}

/// Sets block_ to the GridBlock with the strips of the cluster. Returns false if there is none.
bool FastPageWriter::find_grid() {
  if (header_.creases != 0) return false;
  const ClusterValues& values = *values_;
  std::array<uint8_t, kMaxClusterTriangles> left;
  for (uint32_t i = 0; i < values.triangle_count; ++i) left[i] = values.turns[i] == Turn::kLeft;
  const std::span corners = std::span(values.corners).first(values.corner_count);
  for (uint32_t columns = 1; 2 * columns <= values.triangle_count; ++columns) {
    block_ = grid_size(static_cast<uint8_t>(columns), values.triangle_count, values.vertex_count);
    if (block_.columns == 0) continue;
    block_.diagonals = diagonals_of(columns, block_.rows, std::span(left).first(values.triangle_count));
    find_grid_strips(block_, strips_);
    bool equal = strips_.layout.strip_count == values.strip_count &&
                 std::ranges::equal(corners, std::span(strips_.corners).first(values.corner_count));
    for (uint32_t i = 0; i < values.triangle_count && equal; ++i)
      equal = (strips_.left[i / 64] >> (i % 64) & 1u) == left[i] &&
              (strips_.restart[i / 64] >> (i % 64) & 1u) == (values.turns[i] == Turn::kRestart ? 1u : 0u);
    if (equal) return true;
  }
  return false;
}

/// Finds an earlier grid cluster that has the points of a border, and the channels in which their values are equal.
void FastPageWriter::find_neighbour(const ClusterView& view, GridBorder border) {
  const auto vertex = [&](uint32_t i) {
    return strips_.vertex_of_point[border == kLeftColumn ? block_.point(0, i) : block_.point(i, 0)];
  };
  const auto found = newest_at_[border].find({view.lattice(vertex(0)), view.lattice(vertex(1))});
  if (found == newest_at_[border].end()) return;
  const size_t neighbour = borders_.size() + 1 - found->second;
  if (neighbour > kMaxNeighbour) return;
  std::array<uint64_t, kMaxClusterVertices> words;
  for (uint32_t channel = 0; channel < kChannels; ++channel) {
    const ChannelFrame& frame = frames_[channel];
    if (!borders_.share(border, neighbour, static_cast<Channel>(channel), block_, frame, words.data())) continue;
    bool equal = true;
    for (uint32_t i = 0; i < points_of(block_, border) && equal; ++i)
      equal = words[i] == vertices_[vertex(i)].words[channel];
    if (equal) header_.shared[border] = static_cast<uint8_t>(header_.shared[border] | (1u << channel));
  }
  if (header_.shared[border] != 0) header_.neighbour[border] = static_cast<uint8_t>(neighbour);
}

void FastPageWriter::add_grid(const ClusterView& view) {
  header_.grid = static_cast<uint8_t>(block_.columns);
  if (block_.diagonals != last_diagonals_) {
    header_.grid |= kGridDiagonals;
    BitWriter diagonals;
    for (uint32_t quad = 0; quad < block_.quad_count(); ++quad) diagonals.put(block_.diagonals >> quad & 1u, 1);
    diagonals.align(1);
    put_bytes(parts_[kBits], diagonals);
    last_diagonals_ = block_.diagonals;
  }
  for (const GridBorder border : {kLeftColumn, kLowestRow}) find_neighbour(view, border);
  const auto& vertex_of = strips_.vertex_of_point;
  std::array<std::vector<uint64_t>, kChannels> words;
  std::array<const uint64_t*, kChannels> known{};
  for (uint32_t channel = 0; channel < kChannels; ++channel) {
    if (frames_[channel].layout.field_count == 0 || frames_[channel].layout.verbatim()) continue;
    const auto is_shared = [&](GridBorder border) { return (header_.shared[border] >> channel & 1u) != 0; };
    for (uint32_t y = is_shared(kLowestRow) ? 1 : 0; y <= block_.rows; ++y)
      for (uint32_t x = is_shared(kLeftColumn) ? 1 : 0; x <= block_.columns; ++x) {
        if (x + y == 0) continue;
        std::array<int32_t, 3> guess = grid_guess(block_, x, y);
        for (int32_t& point : guess)
          if (point != kNoPoint) point = vertex_of[static_cast<size_t>(point)];
        add_residuals(channel, vertex_of[block_.point(x, y)], guess);
      }
    for (uint32_t point = 0; point < block_.point_count(); ++point)
      words[channel].push_back(vertices_[vertex_of[point]].words[channel]);
    known[channel] = words[channel].data();
  }
  borders_.add(block_, frames_, known);
  const auto point = [&](uint32_t x, uint32_t y) { return view.lattice(vertex_of[block_.point(x, y)]); };
  newest_at_[kLeftColumn][{point(block_.columns, 0), point(block_.columns, 1)}] = borders_.size();
  newest_at_[kLowestRow][{point(0, block_.rows), point(1, block_.rows)}] = borders_.size();
}

void FastPageWriter::add_topology() {
  const ClusterValues& values = *values_;
  BitWriter turns, fresh, creases;
  std::array<int32_t, 3> t{kNoVertex, kNoVertex, kNoVertex};
  uint32_t corner = 0, used = 0;
  const auto next = [&](std::array<int32_t, 3> guess) {
    const uint32_t vertex = values.corners[corner++];
    const bool is_fresh = vertex == used;
    fresh.put(is_fresh ? 1 : 0, 1);
    used += is_fresh;
    add_corner(vertex, is_fresh, guess);
    return static_cast<int32_t>(vertex);
  };
  for (uint32_t i = 0; i < values.triangle_count; ++i) {
    const Turn turn = values.turns[i];
    turns.put(turn == Turn::kLeft ? 1 : 0, 1);
    if (turn == Turn::kRestart) {
      parts_[kRuns].push_back(0);
      for (uint32_t k = 0; k < 3; ++k) t = {t[1], t[2], next({t[2], kNoVertex, kNoVertex})};
    } else {
      const bool left = turn == Turn::kLeft;
      const std::array<int32_t, 2> kept{left ? t[0] : t[2], left ? t[2] : t[1]};
      t = {kept[0], kept[1], next({kept[0], kept[1], left ? t[1] : t[0]})};
    }
    ++parts_[kRuns].back();
  }
  for (const Vertex& vertex : vertices_) creases.put(vertex.is_crease ? 1 : 0, 1);
  for (BitWriter* writer : {&turns, &fresh, &creases}) writer->align(1);
  put_bytes(parts_[kBits], turns);
  put_bytes(parts_[kBits], fresh);
  if (header_.creases != 0) put_bytes(parts_[kBits], creases);
}

/// @param guess vertices p, q, o of the prediction p + q - o; p only at the start of a strip
void FastPageWriter::add_corner(uint32_t vertex, bool fresh, std::array<int32_t, 3> guess) {
  const Vertex& one = vertices_[vertex];
  if (!fresh || one.is_crease) {
    const uint32_t named = fresh ? one.original : vertex;
    const auto difference = static_cast<int8_t>(static_cast<uint8_t>(named - last_reused_));
    parts_[kReusedVertices].push_back(static_cast<uint8_t>(zigzag(difference)));
    last_reused_ = named;
  }
  if (!fresh || vertex == 0) return;
  for (uint32_t channel = 0; channel < kChannels; ++channel)
    if (channel != kPositions || !one.is_crease) add_residuals(channel, vertex, guess);
}

/// @param guess vertices p, q, o of the prediction p + q - o; kNoVertex means 0
void FastPageWriter::add_residuals(uint32_t channel, uint32_t vertex, std::array<int32_t, 3> guess) {
  const Layout& layout = frames_[channel].layout;
  if (layout.verbatim()) return;
  for (uint32_t i = 0; i < layout.field_count; ++i) {
    const auto value = [&](int32_t v) {
      return v == kNoVertex
                 ? 0
                 : static_cast<int64_t>(field_of(layout, vertices_[static_cast<size_t>(v)].words[channel], i));
    };
    residuals_[channel * kChannelFields + i].push_back(
        zigzag(value(static_cast<int32_t>(vertex)) - (value(guess[0]) + value(guess[1]) - value(guess[2]))));
  }
}

void FastPageWriter::copy_bits(const ClusterView& view, Channel channel, uint64_t first, uint64_t count) {
  while (count > 0) {
    const auto bits = static_cast<uint32_t>(std::min<uint64_t>(count, kMaxFieldBits));
    put(channel, read_bits(view.bits(), first, bits), bits);
    first += bits, count -= bits;
  }
}

void FastPageWriter::add_fields(const ClusterView& view) {
  copy_bits(view, kUvs, prefix_bit_[kUvs], prefix_bits_[kUvs]);
  copy_bits(view, kNormals, prefix_bit_[kNormals], prefix_bits_[kNormals]);
  for (const Channel channel : {kPositions, kNormals, kUvs}) {
    const Layout& layout = frames_[channel].layout;
    if (layout.field_count == 0) continue;
    if (layout.verbatim()) {
      copy_bits(view, channel, prefix_bit_[channel] + prefix_bits_[channel],
                uint64_t{layout.stride()} * vertices_.size());
      continue;
    }
    const bool is_shared = ((header_.shared[kLeftColumn] | header_.shared[kLowestRow]) >> channel & 1u) != 0;
    const uint32_t first = is_grid_ ? strips_.vertex_of_point[0] : 0;
    if (!is_shared) put(channel, vertices_[first].words[channel], layout.stride());
    code_channel(channel);
    put_escapes(channel);
  }
}

void FastPageWriter::code_channel(Channel channel) {
  const uint32_t first = channel * kChannelFields, field_count = frames_[channel].layout.field_count;
  std::array<uint32_t, kChannelFields> low_bits{};
  for (uint32_t i = 0; i < field_count; ++i) {
    const std::vector<uint64_t>& residuals = residuals_[first + i];
    low_bits[i] = choose_low_bits(residuals, kMaxEscapes - static_cast<uint32_t>(escapes_.size()));
    const uint32_t residual_class = class_of(residuals, low_bits[i]);
    header_.coding[first + i] = static_cast<uint8_t>(low_bits[i] | (residual_class << kClassShift));
    for (uint32_t k = 0; k < residuals.size(); ++k) {
      const uint64_t high = residuals[k] >> low_bits[i];
      if (high > kByteMask) escapes_.push_back({i, k, high});
      parts_[kResiduals + residual_class].push_back(high > kByteMask ? 0 : static_cast<uint8_t>(high));
    }
    residual_counts_[residual_class][channel] += residuals.size();
  }
  for (size_t k = 0; k < residuals_[first].size(); ++k)
    for (uint32_t i = 0; i < field_count; ++i)
      put(channel, residuals_[first + i][k] & ((uint64_t{1} << low_bits[i]) - 1), low_bits[i]);
}

void FastPageWriter::put_escapes(Channel channel) {
  for (const Escape& escape : escapes_) {
    const auto width = static_cast<uint32_t>(std::bit_width(escape.high));
    put(channel, escape.field, kEscapeFieldBits);
    put(channel, escape.index, kEscapeIndexBits);
    put(channel, width, kEscapeWidthBits);
    put(channel, escape.high, width);
  }
  header_.escapes[channel] = static_cast<uint8_t>(escapes_.size());
  escapes_.clear();
}

void FastPageWriter::add_header(const baked::ClusterRecord& record) {
  for (size_t i = 0; i < 3; ++i)
    header_.anchor[i] = static_cast<uint32_t>(
        zigzag(static_cast<int32_t>(static_cast<uint32_t>(record.anchor[i]) - static_cast<uint32_t>(last_.anchor[i]))));
  header_.material_slot = record.material_slot ^ last_.material_slot;
  for (size_t i = 0; i < 2; ++i)
    header_.normal_anchor[i] =
        static_cast<uint16_t>(zigzag(static_cast<int16_t>(record.normal_anchor[i] - last_.normal_anchor[i])));
  header_.palette = record.normal_palette;
  header_.triangles = static_cast<uint8_t>(record.triangle_count - 1);
  header_.vertices = static_cast<uint8_t>(record.vertex_count - 1);
  header_.strips = static_cast<uint8_t>(record.strip_count - 1);
  header_.flags = record.flags;
  header_.position_bits = record.position_bits;
  header_.normal_bits = record.normal_bits;
  headers_.push_back(header_);
  last_ = record;
}

std::vector<uint8_t> FastPageWriter::finish(ZSTD_CCtx_s* zstd, std::array<double, kPageStreams>& bits) {
  fields_.align(1);
  parts_[kFields] = fields_.bytes();
  for (size_t byte = 0; byte < kHeaderBytes; ++byte)
    for (const Header& header : headers_)
      parts_[kHeaders].push_back(std::bit_cast<std::array<uint8_t, sizeof header>>(header)[byte]);
  bits = field_bits_;
  Bytes page, data;
  for (uint32_t i = 0; i < kParts; ++i) {
    const Bytes zipped = zip_part(zstd, parts_[i]);
    for (const size_t number : {parts_[i].size(), zipped.size()}) {
      const auto size = static_cast<uint32_t>(number);
      page.insert(page.end(), reinterpret_cast<const uint8_t*>(&size), reinterpret_cast<const uint8_t*>(&size + 1));
    }
    data.insert(data.end(), zipped.begin(), zipped.end());
    count_part(i, 8.0 * static_cast<double>(zipped.size()), bits);
  }
  page.insert(page.end(), data.begin(), data.end());
  return page;
}

void FastPageWriter::count_part(uint32_t part, double part_bits, std::array<double, kPageStreams>& bits) const {
  if (part == kBits || part == kRuns || part == kReusedVertices)
    bits[static_cast<size_t>(PageStream::kTopology)] += part_bits;
  if (part < kResiduals || parts_[part].empty()) return;
  for (uint32_t channel = 0; channel < kChannels; ++channel)
    bits[static_cast<size_t>(kStreamOf[channel])] += part_bits *
                                                     static_cast<double>(residual_counts_[part - kResiduals][channel]) /
                                                     static_cast<double>(parts_[part].size());
}

} // namespace packtrace
