#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/base/setting.h"

namespace packtrace {

/// Settings of the reference denoiser.
struct ReferenceConfig {
  uint32_t max_tspp = 33;

  /// Throws Error(kUsage) naming the first field that is out of range.
  void validate() const;
};

/// The description of all fields.
std::span<const Setting<ReferenceConfig>> reference_settings();

} // namespace packtrace
