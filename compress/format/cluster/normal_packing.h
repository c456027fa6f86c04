#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "compress/format/cluster/normal_codec.h"

namespace packtrace {

/// How one cluster stores its normals: as unsigned differences of x and y to an anchor, with or without a chart each.
struct NormalPacking {
  bool mixed_charts = false;       ///< each normal has its chart; else all are unfolded around `chart`
  uint32_t chart = 0;              ///< 0 where mixed
  std::array<int16_t, 2> anchor{}; ///< of x and y, in units of two codes; rounded down
  std::array<uint8_t, 2> bits{};   ///< of x and y
  uint32_t chart_bits = 0;         ///< 0 unless mixed

  uint32_t stride() const { return uint32_t{bits[0]} + bits[1] + chart_bits; } ///< bits of a normal
};

/// The narrowest packing of some normals around `chart`, or with a chart each where chart ==
/// format_of(encoding).charts; nothing where that is impossible. Allocates nothing.
/// @param fields canonical, not empty
std::optional<NormalPacking> pack_normals(NormalEncoding encoding, std::span<const NormalFields> fields,
                                          uint32_t chart);

/// The narrowest packing of all: around the lowest such chart, or mixed where that is narrower.
NormalPacking choose_normal_packing(NormalEncoding encoding, std::span<const NormalFields> fields);

/// What is stored of one of the normals that were packed: y in the lowest bits, then x, then the chart where mixed.
uint64_t packed_normal(NormalEncoding encoding, const NormalPacking& packing, NormalFields fields);

} // namespace packtrace
