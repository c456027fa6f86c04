#pragma once

#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {

/// Throws Error(kUsage) that names the parameter and its range unless lo <= value <= hi; NaN is rejected.
template <typename T>
void check_parameter(std::string_view name, T value, T lo, T hi) {
  if (value >= lo && value <= hi) return;
  throw Error(ErrorKind::kUsage, fmt::format("{} {}: it must be {} to {}", name, value, lo, hi));
}

} // namespace packtrace::scenegen
