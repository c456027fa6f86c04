#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/base/setting.h"

namespace packtrace {

/// Parameters of the specular path tracer; shade_settings() has their ranges (docs/shading.md).
struct ShadeConfig {
  uint32_t depth = 3;         ///< reflections of a path after the camera's hit; twice as many transmissions
  uint32_t shadow_depth = 4;  ///< transmissive surfaces that light passes on its way; 0: glass casts shadows
  float ambient = 0.4f;       ///< radiance of the constant light from everywhere
  uint32_t light_samples = 4; ///< samples of the lights at the camera's hit; one at later hits
  uint32_t samples = 1;       ///< paths per pixel and frame
  float light_turn = 0.0f;    ///< degrees by which the lights are turned about the vertical, [0, 360]

  bool operator==(const ShadeConfig&) const = default;
};

/// The numbers of ShadeConfig.
std::span<const Setting<ShadeConfig>> shade_settings();

/// Throws Error(kUsage) naming the first parameter out of range, its value and the range.
void validate(const ShadeConfig& config);

} // namespace packtrace
