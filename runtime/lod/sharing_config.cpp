#include "runtime/lod/sharing_config.h"

#include <limits>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

void require_range(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return; // false for NaN
  throw Error(ErrorKind::kUsage, std::string("sharing of levels of detail: ") + name + " is " + std::to_string(value) +
                                     ", not in [" + std::to_string(low) + ".." + std::to_string(high) + "]");
}

} // namespace

void SharingConfig::validate() const {
  require_range("scheme", static_cast<double>(scheme), 0, static_cast<double>(SharingScheme::kSteps));
  require_range("step_ratio", step_ratio, 1.05, 16.0);
  if (traced_ratio != 0.0) require_range("traced_ratio", traced_ratio, 1.0, std::numeric_limits<double>::infinity());
  require_range("own_cut_ratio", own_cut_ratio, 1.0, std::numeric_limits<double>::infinity());
  require_range("shared_levels", shared_levels, 0, 32);
  require_range("tolerant_levels", tolerant_levels, 0, 32);
  require_range("culled_coarser_levels", culled_coarser_levels, 0, 32);
  require_range("culled_error_scale", culled_error_scale, 1.0, 1e6);
}

} // namespace packtrace
