#include "compress/format/cluster/normal_packing.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <vector>

#include "compress/format/layout/bit_stream.h"

namespace packtrace {
namespace {

/// Range of one component, x or y.
struct Range {
  int32_t lo = std::numeric_limits<int32_t>::max(), hi = std::numeric_limits<int32_t>::min();
  void add(int32_t value) { lo = std::min(lo, value), hi = std::max(hi, value); }
  int32_t anchor() const { return lo >> 1; } // floor
  uint8_t bits() const { return static_cast<uint8_t>(std::bit_width(static_cast<uint32_t>(hi - 2 * anchor()))); }
};

/// Returns two normals per chart that is used: one with the least x and y of its normals, one with the largest.
/// unfold_normal() maps x and y monotonically and may exchange them, so the range of the two is that of all.
std::vector<NormalFields> chart_corners(std::span<const NormalFields> fields) {
  constexpr uint32_t kMaxCharts = 6;
  std::array<Range, kMaxCharts> x, y;
  for (const NormalFields& one : fields) x[one.chart].add(one.x), y[one.chart].add(one.y);
  std::vector<NormalFields> corners;
  corners.reserve(2 * kMaxCharts);
  for (uint32_t chart = 0; chart < kMaxCharts; ++chart)
    if (x[chart].lo <= x[chart].hi)
      corners.push_back({chart, x[chart].lo, y[chart].lo}), corners.push_back({chart, x[chart].hi, y[chart].hi});
  return corners;
}

} // namespace

std::optional<NormalPacking> pack_normals(NormalEncoding encoding, std::span<const NormalFields> fields,
                                          uint32_t chart) {
  const uint32_t charts = format_of(encoding).charts;
  const bool mixed = chart == charts;
  if (mixed && charts == 1) return std::nullopt;
  Range x, y;
  for (const NormalFields& one : fields) {
    const std::optional<NormalFields> placed = mixed ? one : unfold_normal(encoding, one, chart);
    if (!placed) return std::nullopt;
    x.add(placed->x), y.add(placed->y);
  }
  return NormalPacking{mixed,
                       mixed ? 0 : chart,
                       {static_cast<int16_t>(x.anchor()), static_cast<int16_t>(y.anchor())},
                       {x.bits(), y.bits()},
                       mixed ? bits_for_count(charts) : 0};
}

NormalPacking choose_normal_packing(NormalEncoding encoding, std::span<const NormalFields> fields) {
  const std::vector<NormalFields> corners = chart_corners(fields);
  std::optional<NormalPacking> best;
  for (uint32_t chart = 0; chart <= format_of(encoding).charts; ++chart) {
    const std::optional<NormalPacking> packing = pack_normals(encoding, corners, chart);
    if (packing && (!best || packing->stride() < best->stride())) best = packing;
  }
  assert(best);
  return *best;
}

uint64_t packed_normal(NormalEncoding encoding, const NormalPacking& packing, NormalFields fields) {
  const NormalFields placed =
      packing.mixed_charts ? fields : unfold_normal(encoding, fields, packing.chart).value_or(fields);
  const auto x = static_cast<uint64_t>(placed.x - 2 * packing.anchor[0]);
  const auto y = static_cast<uint64_t>(placed.y - 2 * packing.anchor[1]);
  const uint64_t chart = packing.mixed_charts ? fields.chart : 0;
  return y | (x << packing.bits[1]) | (chart << (packing.bits[0] + packing.bits[1]));
}

} // namespace packtrace
