#include "compress/format/cluster/position_grid.h"

#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {

PositionGrid choose_position_grid(double max_step) {
  if (!(max_step > 0.0) || !std::isfinite(max_step))
    throw Error(ErrorKind::kLimitExceeded, "the position step must be a positive number");
  const int32_t exponent = std::ilogb(max_step) - 3; // max_step in [8, 16) 2^exponent
  if (exponent < kMinStepExponent || exponent > kMaxStepExponent)
    throw Error(ErrorKind::kLimitExceeded, "the position step's exponent " + std::to_string(exponent) +
                                               " lies outside " + std::to_string(kMinStepExponent) + " .. " +
                                               std::to_string(kMaxStepExponent));
  return {static_cast<uint32_t>(std::floor(std::ldexp(max_step, -exponent))), exponent};
}

double position_error_bound(double step, double max_abs) {
  constexpr double kHalfFloatUlp = 0x1p-24, kSmallestFloatHalf = 0x1p-150, kDoubleRoundings = 0x1p-51;
  const double largest = max_abs + step; // quantisation may move the largest coordinate outwards
  return 0.5 * step + largest * (kHalfFloatUlp + kDoubleRoundings) + kSmallestFloatHalf;
}

} // namespace packtrace
