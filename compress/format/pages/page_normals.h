#pragma once

#include <algorithm>
#include <cmath>

#include "compress/format/cluster/normal_codec.h"

namespace packtrace {

/// Returns canonical fields near the code of a unit vector, not necessarily equal. The same on every machine: only +,
/// -, x, / of doubles are used. For zero vectors the result is unspecified but valid.
inline NormalFields predict_normal_fields(NormalEncoding encoding, DVec3 n) {
  const NormalFormat& format = format_of(encoding);
  const auto x_last = static_cast<int32_t>(format.x_codes) - 1, y_last = static_cast<int32_t>(format.y_codes) - 1;
  /// Code of a coordinate in -1 .. 1.
  const auto code = [](double t, int32_t last) {
    return std::clamp(static_cast<int32_t>((t + 1.0) * 0.5 * last + 0.5), 0, last);
  };
  if (format.family == NormalFamily::kOct) {
    const double sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    if (sum > 0.0) n *= 1.0 / sum;
    const double fold = std::max(-n.z, 0.0);
    return {0, code(n.x + std::copysign(fold, n.x), x_last - 1), code(n.y + std::copysign(fold, n.y), y_last - 1)};
  }
  if (format.family == NormalFamily::kZsign) return {n.z < 0.0 ? 1u : 0u, code(n.x, x_last - 1), code(n.y, y_last - 1)};
  int axis = 0;
  for (int other = 1; other < 3; ++other)
    if (std::abs(n[other]) > std::abs(n[axis])) axis = other;
  // Inverts the cubic of decode_normal(): a series with errors of a few thousandths, then one Newton step.
  const auto unwarp = [](double x) {
    const double square = x * x, t = x * (1.2752 + square * (0.16 + square * 0.23));
    return t - (t * (kAxisSlope + kAxisCubic * t * t) - x) / (kAxisSlope + 3.0 * kAxisCubic * t * t);
  };
  return {static_cast<uint32_t>(2 * axis) + (n[axis] < 0.0 ? 1 : 0), code(unwarp(n[(axis + 1) % 3]), x_last),
          code(unwarp(n[(axis + 2) % 3]), y_last)};
}

} // namespace packtrace
