#include "compress/format/pages/page_cluster.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "compress/format/layout/bit_stream.h"

namespace packtrace {
namespace {

void unpack_strips(const ClusterView& view, ClusterValues& values) {
  const IndexLayout& layout = view.layout();
  const uint8_t* bits = view.bits();
  for (uint32_t t = 0; t < layout.triangle_count; ++t) {
    const bool restart = read_bits(bits, t, 1) != 0, left = read_bits(bits, layout.triangle_count + t, 1) != 0;
    values.turns[t] = restart ? Turn::kRestart : left ? Turn::kLeft : Turn::kRight;
  }
  values.corner_count = layout.corner_count();
  const uint32_t width = layout.index_bits();
  uint64_t explicit_at = layout.explicit_bit();
  uint16_t used = 0;
  for (uint32_t corner = 0; corner < values.corner_count; ++corner) {
    if (read_bits(bits, layout.fresh_bit() + corner, 1) != 0) {
      values.corners[corner] = used++;
    } else {
      values.corners[corner] = static_cast<uint16_t>(read_bits(bits, explicit_at, width));
      explicit_at += width;
    }
  }
}

void unpack_normals(const ClusterView& view, ClusterValues& values) {
  const uint32_t flags = view.record().flags;
  values.normal_chart = (flags & baked::kClusterMixedCharts) != 0
                            ? format_of(view.normal_encoding()).charts
                            : (flags & baked::kClusterChart) >> baked::kClusterChartShift;
  values.normal_palette = view.record().normal_palette != 0;
  for (uint32_t v = 0; v < values.vertex_count; ++v) values.normals[v] = view.normal_fields(v);
}

void unpack_uvs(const ClusterView& view, ClusterValues& values) {
  const ClusterView::StreamBits stream = view.stream_bits();
  uint64_t at = stream.total() - stream.uvs;
  const auto take = [&](uint32_t bits) {
    at += bits;
    return static_cast<uint32_t>(read_bits(view.bits(), at - bits, bits));
  };
  const uint32_t u_lo = take(kUvAnchorBits), v_lo = take(kUvAnchorBits);
  const uint32_t u_bits = take(kUvWidthBits), v_bits = take(kUvWidthBits);
  for (uint32_t v = 0; v < values.vertex_count; ++v) {
    const uint32_t u = u_lo + take(u_bits);
    values.uvs[v] = {static_cast<int32_t>(u), static_cast<int32_t>(v_lo + take(v_bits))};
  }
}

} // namespace

void unpack_cluster(const ClusterView& view, ClusterValues& values) {
  values.triangle_count = view.triangle_count();
  values.vertex_count = view.vertex_count();
  values.strip_count = view.layout().strip_count;
  values.material = view.material_slot();
  values.has_normals = view.has_normals();
  values.has_uvs = view.has_uvs();
  unpack_strips(view, values);
  for (uint32_t v = 0; v < values.vertex_count; ++v) values.positions[v] = view.lattice(v);
  if (values.has_normals) unpack_normals(view, values);
  if (values.has_uvs) unpack_uvs(view, values);
}

bool ClusterPacker::plan_positions(const baked::GeometryRecord& geometry, const ClusterValues& values,
                                   baked::ClusterRecord& record) {
  LatticePoint lo = values.positions[0], hi = lo;
  for (uint32_t v = 1; v < values.vertex_count; ++v)
    for (size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = std::min(lo[axis], values.positions[v][axis]);
      hi[axis] = std::max(hi[axis], values.positions[v][axis]);
    }
  for (size_t axis = 0; axis < 3; ++axis) {
    if (lo[axis] < -2 * kMaxLattice || hi[axis] > 2 * kMaxLattice) return false;
    const int64_t anchor = (lo[axis] - geometry.origin[axis]) >> geometry.anchor_shift; // floor
    if (anchor < std::numeric_limits<int32_t>::min() || anchor > std::numeric_limits<int32_t>::max()) return false;
    base_[axis] = geometry.origin[axis] + anchor * (int64_t{1} << geometry.anchor_shift);
    record.anchor[axis] = static_cast<int32_t>(anchor);
    const auto bits = static_cast<uint32_t>(std::bit_width(static_cast<uint64_t>(hi[axis] - base_[axis])));
    if (bits > kMaxFieldBits) return false;
    record.position_bits[axis] = static_cast<uint8_t>(bits);
  }
  return true;
}

bool ClusterPacker::plan_normals(const baked::GeometryRecord& geometry, const ClusterValues& values,
                                 baked::ClusterRecord& record) {
  palette_count_ = 0;
  if (!values.has_normals) return true;
  encoding_ = static_cast<NormalEncoding>(geometry.normal_encoding);
  if (values.normal_chart > format_of(encoding_).charts) return false;
  const auto packing =
      pack_normals(encoding_, std::span(values.normals).first(values.vertex_count), values.normal_chart);
  if (!packing) return false;
  normals_ = *packing;
  record.flags = static_cast<uint8_t>(baked::kClusterHasNormals | (normals_.chart << baked::kClusterChartShift) |
                                      (normals_.mixed_charts ? baked::kClusterMixedCharts : 0));
  record.normal_anchor = normals_.anchor;
  record.normal_bits = normals_.bits;
  if (values.normal_palette) find_palette(values);
  record.normal_palette = static_cast<uint16_t>(palette_count_);
  return true;
}

void ClusterPacker::find_palette(const ClusterValues& values) {
  // A hash table finds the distinct codes in order of first use; then they are sorted.
  constexpr uint32_t kSlots = 1024, kFree = 0xffff;
  std::array<uint16_t, kSlots> slots;
  slots.fill(kFree);
  std::array<uint8_t, kMaxClusterVertices> use; // by vertex: number of its code in order of first use
  // Code in the upper bits, its number in order of first use in the low 8 bits.
  std::array<uint64_t, kMaxClusterVertices> order;
  for (uint32_t v = 0; v < values.vertex_count; ++v) {
    const uint32_t code = join_normal_code(encoding_, values.normals[v]);
    uint32_t slot = (code * 0x9e3779b1u) >> 22;
    while (slots[slot] != kFree && order[slots[slot]] >> 8 != code) slot = (slot + 1) % kSlots;
    if (slots[slot] == kFree) {
      slots[slot] = static_cast<uint16_t>(palette_count_);
      palette_[palette_count_] = values.normals[v];
      order[palette_count_] = (uint64_t{code} << 8) | palette_count_;
      ++palette_count_;
    }
    use[v] = static_cast<uint8_t>(slots[slot]);
  }
  std::sort(order.begin(), order.begin() + palette_count_);
  std::array<uint8_t, kMaxClusterVertices> place;
  std::array<NormalFields, kMaxClusterVertices> sorted;
  for (uint32_t i = 0; i < palette_count_; ++i) {
    const auto from = static_cast<size_t>(order[i] & 0xffu);
    place[from] = static_cast<uint8_t>(i);
    sorted[i] = palette_[from];
  }
  std::copy_n(sorted.begin(), palette_count_, palette_.begin());
  for (uint32_t v = 0; v < values.vertex_count; ++v) palette_entry_[v] = place[use[v]];
}

bool ClusterPacker::plan_uvs(const ClusterValues& values, baked::ClusterRecord& record) {
  uv_bits_ = {};
  if (!values.has_uvs) return true;
  record.flags |= baked::kClusterHasUvs;
  uv_lo_ = values.uvs[0];
  UvLattice hi = uv_lo_;
  for (uint32_t v = 1; v < values.vertex_count; ++v)
    for (size_t axis = 0; axis < 2; ++axis) {
      uv_lo_[axis] = std::min(uv_lo_[axis], values.uvs[v][axis]);
      hi[axis] = std::max(hi[axis], values.uvs[v][axis]);
    }
  for (size_t axis = 0; axis < 2; ++axis) {
    const uint32_t span = static_cast<uint32_t>(hi[axis]) - static_cast<uint32_t>(uv_lo_[axis]);
    uv_bits_[axis] = static_cast<uint32_t>(std::bit_width(span));
    if (uv_bits_[axis] >= 1u << kUvWidthBits) return false;
  }
  return true;
}

void ClusterPacker::put_strips(const ClusterValues& values, const IndexLayout& layout) {
  for (uint32_t first = 0; first < layout.triangle_count; first += 32) {
    const uint32_t count = std::min(layout.triangle_count - first, 32u);
    uint64_t word = 0;
    for (uint32_t i = 0; i < count; ++i) word |= uint64_t{values.turns[first + i] == Turn::kRestart} << i;
    payload_.put(word, count);
  }
  for (uint32_t first = 0; first < layout.triangle_count; first += 32) {
    const uint32_t count = std::min(layout.triangle_count - first, 32u);
    uint64_t word = 0;
    for (uint32_t i = 0; i < count; ++i) word |= uint64_t{values.turns[first + i] == Turn::kLeft} << i;
    payload_.put(word, count);
  }
  uint32_t used = 0, explicit_count = 0;
  std::array<uint16_t, kMaxClusterCorners> explicits;
  for (uint32_t first = 0; first < values.corner_count; first += 32) {
    const uint32_t count = std::min(values.corner_count - first, 32u);
    uint64_t word = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const uint16_t vertex = values.corners[first + i];
      const bool fresh = vertex == used;
      explicits[explicit_count] = vertex;
      explicit_count += !fresh, used += fresh;
      word |= uint64_t{fresh} << i;
    }
    payload_.put(word, count);
  }
  const uint32_t width = layout.index_bits();
  for (uint32_t i = 0; i < explicit_count; ++i) payload_.put(explicits[i], width);
}

void ClusterPacker::put_positions(const ClusterValues& values, const baked::ClusterRecord& record) {
  const auto [x_bits, y_bits, z_bits] = record.position_bits;
  const uint32_t vertex_bits = uint32_t{x_bits} + y_bits + z_bits;
  for (uint32_t v = 0; v < values.vertex_count; ++v) {
    const LatticePoint& p = values.positions[v];
    const auto x = static_cast<uint64_t>(p[0] - base_[0]), y = static_cast<uint64_t>(p[1] - base_[1]),
               z = static_cast<uint64_t>(p[2] - base_[2]);
    if (vertex_bits <= kMaxFieldBits) {
      payload_.put(x | (y << x_bits) | (z << (x_bits + y_bits)), vertex_bits);
    } else {
      payload_.put(x, x_bits), payload_.put(y, y_bits), payload_.put(z, z_bits);
    }
  }
}

void ClusterPacker::put_normals(const ClusterValues& values) {
  const auto put_one = [&](NormalFields fields) {
    payload_.put(packed_normal(encoding_, normals_, fields), normals_.stride());
  };
  if (palette_count_ == 0) {
    for (uint32_t v = 0; v < values.vertex_count; ++v) put_one(values.normals[v]);
    return;
  }
  for (uint32_t i = 0; i < palette_count_; ++i) put_one(palette_[i]);
  const uint32_t width = bits_for_count(palette_count_);
  for (uint32_t v = 0; v < values.vertex_count; ++v) payload_.put(palette_entry_[v], width);
}

void ClusterPacker::put_uvs(const ClusterValues& values) {
  for (const int32_t lo : uv_lo_) payload_.put(static_cast<uint32_t>(lo), kUvAnchorBits);
  for (const uint32_t width : uv_bits_) payload_.put(width, kUvWidthBits);
  for (uint32_t v = 0; v < values.vertex_count; ++v)
    for (size_t axis = 0; axis < 2; ++axis)
      payload_.put(static_cast<uint32_t>(values.uvs[v][axis]) - static_cast<uint32_t>(uv_lo_[axis]), uv_bits_[axis]);
}

bool ClusterPacker::append(const baked::GeometryRecord& geometry, const ClusterValues& values,
                           baked::ClusterRecord& record) {
  record = {};
  const IndexLayout layout{values.triangle_count, values.vertex_count, values.strip_count};
  record.material_slot = values.material;
  record.triangle_count = static_cast<uint8_t>(layout.triangle_count);
  record.vertex_count = static_cast<uint16_t>(layout.vertex_count);
  record.strip_count = static_cast<uint8_t>(layout.strip_count);
  if (!plan_positions(geometry, values, record) || !plan_normals(geometry, values, record) || !plan_uvs(values, record))
    return false;
  const uint64_t count = values.vertex_count;
  uint64_t bits = layout.total_bits();
  for (const uint32_t width : record.position_bits) bits += count * width;
  if (values.has_normals)
    bits += palette_count_ == 0 ? count * normals_.stride()
                                : palette_count_ * normals_.stride() + count * bits_for_count(palette_count_);
  if (values.has_uvs) bits += kUvHeaderBits + count * (uv_bits_[0] + uv_bits_[1]);
  if (!payload_.begin_cluster(bits)) return false;
  put_strips(values, layout);
  put_positions(values, record);
  if (values.has_normals) put_normals(values);
  if (values.has_uvs) put_uvs(values);
  return true;
}

} // namespace packtrace
