#include "compress/format/uv_codec.h"

#include <algorithm>

namespace packtrace {

int32_t choose_uv_exponent(uint32_t texels, float scale, float max_abs) {
  // A scale of 0 looks up one texel whatever the coordinate: any step does.
  const double per_uv = kUvCodesPerTexel * texels * std::abs(static_cast<double>(scale));
  const int32_t wanted =
      per_uv > 0.0 && std::isfinite(per_uv) ? -static_cast<int32_t>(std::ceil(std::log2(per_uv))) : 0;
  // |uv| < 2^(ilogb + 1), so this exponent puts it below 2^24 steps; rounding can reach 2^24 but not pass it.
  const int32_t finest = max_abs > 0.0f ? std::ilogb(max_abs) - 23 : kMinUvExponent;
  return std::clamp(std::max(wanted, finest), kMinUvExponent, kMaxUvExponent);
}

} // namespace packtrace
