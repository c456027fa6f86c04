#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "compress/format/cluster/normal_codec.h"

namespace packtrace {

/// Storage of one cluster's normals: unsigned differences of x and y to an anchor, with or without a chart per normal.
struct NormalPacking {
  bool mixed_charts = false;       ///< each normal stores its chart; else all are unfolded around `chart`
  uint32_t chart = 0;              ///< 0 if mixed
  std::array<int16_t, 2> anchor{}; ///< of x and y, in units of two codes; rounded down
  std::array<uint8_t, 2> bits{};   ///< widths of x and y
  uint32_t chart_bits = 0;         ///< 0 unless mixed

  uint32_t stride() const { return uint32_t{bits[0]} + bits[1] + chart_bits; } ///< bits per normal
  bool operator==(const NormalPacking&) const = default;
};

/// Returns the narrowest packing of `fields` unfolded around `chart`, or with a chart per normal if chart ==
/// format_of(encoding).charts. Returns nothing if that is impossible. Does not allocate.
/// @param fields canonical, not empty
std::optional<NormalPacking> pack_normals(NormalEncoding encoding, std::span<const NormalFields> fields,
                                          uint32_t chart);

/// Returns the narrowest packing: around the lowest of the best charts, or mixed if that is narrower.
NormalPacking choose_normal_packing(NormalEncoding encoding, std::span<const NormalFields> fields);

/// Returns the stored bits of one of the packed normals: y in the lowest bits, then x, then the chart if mixed.
uint64_t packed_normal(NormalEncoding encoding, const NormalPacking& packing, NormalFields fields);

} // namespace packtrace
