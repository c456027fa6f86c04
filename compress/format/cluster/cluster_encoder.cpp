#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <limits>
#include <vector>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/cluster/normal_packing.h"
#include "compress/format/layout/bit_stream.h"

namespace packtrace {
namespace {

void write_positions(const ClusterInput& input, baked::ClusterRecord& record, BitWriter& writer) {
  LatticePoint base{};
  for (size_t axis = 0; axis < 3; ++axis) {
    int64_t lo = std::numeric_limits<int64_t>::max(), hi = std::numeric_limits<int64_t>::min();
    for (const LatticePoint& p : input.positions) lo = std::min(lo, p[axis]), hi = std::max(hi, p[axis]);
    const int64_t anchor = (lo - input.origin[axis]) >> input.anchor_shift; // floor
    assert(anchor >= std::numeric_limits<int32_t>::min() && anchor <= std::numeric_limits<int32_t>::max());
    base[axis] = input.origin[axis] + anchor * (int64_t{1} << input.anchor_shift);
    record.anchor[axis] = static_cast<int32_t>(anchor);
    record.position_bits[axis] = static_cast<uint8_t>(std::bit_width(static_cast<uint64_t>(hi - base[axis])));
  }
  for (const LatticePoint& p : input.positions)
    for (size_t axis = 0; axis < 3; ++axis)
      writer.put(static_cast<uint64_t>(p[axis] - base[axis]), record.position_bits[axis]);
}

/// Number of distinct codes of a cluster's vertices.
size_t count_distinct(std::span<const uint32_t> codes) {
  constexpr uint32_t kSlotBits = 9; // twice as many slots as codes
  static_assert(kMaxClusterVertices <= 1u << (kSlotBits - 1));
  constexpr uint32_t kSlots = 1u << kSlotBits;
  std::array<uint16_t, kSlots> first{}; // 1 + the place of the first of equal codes, 0 for none
  size_t distinct = 0;
  for (size_t i = 0; i < codes.size(); ++i) {
    uint32_t slot = (codes[i] * 0x9e3779b1u) >> (32 - kSlotBits);
    while (first[slot] != 0 && codes[first[slot] - 1u] != codes[i]) slot = (slot + 1) % kSlots;
    if (first[slot] != 0) continue;
    first[slot] = static_cast<uint16_t>(i + 1);
    ++distinct;
  }
  return distinct;
}

void write_normals(const ClusterInput& input, baked::ClusterRecord& record, BitWriter& writer) {
  const std::span<const uint32_t> codes = input.normal_codes;
  if (codes.empty()) return;
  const NormalEncoding encoding = input.normal_encoding;
  std::vector<NormalFields> fields;
  fields.reserve(codes.size());
  for (const uint32_t code : codes) fields.push_back(split_normal_code(encoding, code));
  const NormalPacking packing = choose_normal_packing(encoding, fields);

  record.flags = static_cast<uint8_t>(baked::kClusterHasNormals | (packing.chart << baked::kClusterChartShift) |
                                      (packing.mixed_charts ? baked::kClusterMixedCharts : 0));
  record.normal_anchor = packing.anchor;
  record.normal_bits = packing.bits;
  const size_t distinct = count_distinct(codes);
  const uint32_t stride = packing.stride(), entry_bits = bits_for_count(distinct);
  const auto put = [&](NormalFields normal) { writer.put(packed_normal(encoding, packing, normal), stride); };
  if (distinct * stride + codes.size() * entry_bits < codes.size() * stride) {
    std::vector<uint32_t> palette(codes.begin(), codes.end());
    std::sort(palette.begin(), palette.end());
    palette.erase(std::unique(palette.begin(), palette.end()), palette.end());
    record.normal_palette = static_cast<uint16_t>(distinct);
    for (const uint32_t code : palette) put(split_normal_code(encoding, code));
    for (const uint32_t code : codes)
      writer.put(static_cast<uint64_t>(std::lower_bound(palette.begin(), palette.end(), code) - palette.begin()),
                 entry_bits);
  } else {
    for (const NormalFields& normal : fields) put(normal);
  }
}

void write_uvs(std::span<const UvLattice> uvs, baked::ClusterRecord& record, BitWriter& writer) {
  if (uvs.empty()) return;
  record.flags |= baked::kClusterHasUvs;
  UvLattice lo{kMaxUvLattice, kMaxUvLattice}, hi{-kMaxUvLattice, -kMaxUvLattice};
  for (const UvLattice& uv : uvs)
    for (size_t axis = 0; axis < 2; ++axis)
      lo[axis] = std::min(lo[axis], uv[axis]), hi[axis] = std::max(hi[axis], uv[axis]);
  std::array<uint32_t, 2> width{};
  for (size_t axis = 0; axis < 2; ++axis) {
    width[axis] = static_cast<uint32_t>(std::bit_width(static_cast<uint32_t>(hi[axis] - lo[axis])));
    writer.put(static_cast<uint32_t>(lo[axis]), kUvAnchorBits);
  }
  for (const uint32_t bits : width) writer.put(bits, kUvWidthBits);
  for (const UvLattice& uv : uvs)
    for (size_t axis = 0; axis < 2; ++axis) writer.put(static_cast<uint32_t>(uv[axis] - lo[axis]), width[axis]);
}

} // namespace

baked::ClusterRecord encode_cluster(const ClusterInput& input, BitWriter& writer) {
  const IndexLayout& layout = input.strips->layout;
  assert(input.positions.size() == layout.vertex_count);
  assert(input.normal_codes.empty() || input.normal_codes.size() == layout.vertex_count);
  assert(input.uvs.empty() || input.uvs.size() == layout.vertex_count);
  baked::ClusterRecord record{};
  record.material_slot = input.material_slot;
  record.triangle_count = static_cast<uint8_t>(layout.triangle_count);
  record.vertex_count = static_cast<uint16_t>(layout.vertex_count);
  record.strip_count = static_cast<uint8_t>(layout.strip_count);
  write_strips(*input.strips, writer);
  write_positions(input, record, writer);
  write_normals(input, record, writer);
  write_uvs(input.uvs, record, writer);
  writer.align(4);
  return record;
}

} // namespace packtrace
