#include "compress/bake/bake_config.h"

#include <cmath>
#include <limits>
#include <string>

#include "pbrt_import/scene/error.h"

namespace packtrace {

void BakeConfig::validate() const {
  const auto require = [](bool ok, const char* range) {
    if (!ok) throw Error(ErrorKind::kUsage, std::string("precision out of range: ") + range);
  };
  switch (precision_kind) {
  case PrecisionKind::kEdgeFraction:
    return require(precision >= 1e-9 && precision <= 1.0, "a fraction of the median edge must be 1e-9 .. 1");
  case PrecisionKind::kDiagonalFraction:
    return require(precision >= 1e-12 && precision <= 0.1, "a fraction of the diagonal must be 1e-12 .. 0.1");
  case PrecisionKind::kAbsolute:
    return require(precision >= std::numeric_limits<float>::denorm_min() &&
                       precision <= std::numeric_limits<float>::max(),
                   "an absolute precision must be a positive float");
  case PrecisionKind::kPositionBits:
    return require(precision >= 1.0 && precision <= 40.0 && precision == std::floor(precision),
                   "position bits must be a whole number 1 .. 40");
  }
  throw Error(ErrorKind::kUsage, "unknown kind of precision");
}

} // namespace packtrace
