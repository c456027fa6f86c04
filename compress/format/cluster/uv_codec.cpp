#include "compress/format/cluster/uv_codec.h"

#include <algorithm>
#include <cmath>

#include "compress/format/cluster/position_grid.h"

namespace packtrace {
namespace {

constexpr double kUnorm16 = 65535.0;
constexpr int32_t kFp16FractionBits = 10, kFp16MinExponent = -14;

} // namespace

std::optional<UvEncoding> find_uv_encoding(std::string_view name) {
  const auto found = std::find(kUvEncodingNames.begin(), kUvEncodingNames.end(), name);
  if (found == kUvEncodingNames.end()) return std::nullopt;
  return static_cast<UvEncoding>(found - kUvEncodingNames.begin());
}

int32_t choose_uv_exponent(uint32_t texels, float scale, float max_abs) {
  // With a scale of 0 every coordinate looks up the same texel, so any step suffices.
  const double per_uv = kUvCodesPerTexel * texels * std::abs(static_cast<double>(scale));
  const int32_t wanted =
      per_uv > 0.0 && std::isfinite(per_uv) ? -static_cast<int32_t>(std::ceil(std::log2(per_uv))) : 0;
  // |uv| < 2^(ilogb + 1), so this exponent keeps it below 2^30 steps. The 24 bits of max_abs are not rounded at this
  // step.
  const int32_t finest = max_abs > 0.0f ? std::ilogb(max_abs) - 29 : kMinUvExponent;
  return std::clamp(std::max(wanted, finest), kMinUvExponent, kMaxUvExponent);
}

std::optional<int32_t> encode_uv(UvEncoding encoding, float uv, int32_t exponent) {
  const auto whole = [](double code) -> std::optional<int32_t> {
    if (!(std::abs(code) <= kMaxUvLattice)) return std::nullopt;
    return static_cast<int32_t>(std::lrint(code));
  };
  if (encoding == UvEncoding::kLattice) return whole(std::ldexp(static_cast<double>(uv), -exponent));
  if (encoding == UvEncoding::kUnorm16) return whole(static_cast<double>(uv) * kUnorm16);
  if (uv == 0.0f) return 0;
  // Subnormal numbers keep the step of the smallest normal ones. A fraction that rounds up carries into the exponent.
  const int32_t binade = std::max(std::ilogb(uv), kFp16MinExponent);
  if (binade > 15) return std::nullopt;
  const auto fraction =
      static_cast<int32_t>(std::lrint(std::ldexp(static_cast<double>(std::abs(uv)), kFp16FractionBits - binade)));
  const int32_t code = ((binade - kFp16MinExponent) << kFp16FractionBits) + fraction;
  if (code > kMaxFp16Code) return std::nullopt;
  return std::signbit(uv) ? -code : code;
}

UvDecoder::UvDecoder(UvEncoding encoding, int32_t exponent)
    : encoding_(encoding), step_(encoding == UvEncoding::kLattice ? exp2_exact(exponent) : 1.0),
      divisor_(encoding == UvEncoding::kUnorm16 ? kUnorm16 : 1.0) {}

float UvDecoder::from_fp16(int64_t code) {
  const auto bits = static_cast<int32_t>(std::min<int64_t>(std::abs(code), kMaxFp16Code));
  const int32_t binade = std::max(bits >> kFp16FractionBits, 1), fraction = bits & ((1 << kFp16FractionBits) - 1);
  const int32_t whole = bits >> kFp16FractionBits == 0 ? fraction : fraction + (1 << kFp16FractionBits);
  const double value = static_cast<double>(whole) * exp2_exact(binade - 1 + kFp16MinExponent - kFp16FractionBits);
  return static_cast<float>(code < 0 ? -value : value);
}

} // namespace packtrace
