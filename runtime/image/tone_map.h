#pragma once

#include "pbrt_import/scene/math.h"

namespace packtrace {

enum class ToneMap { kSrgb, kAces };

/// Conversion of radiance to display values.
struct Exposure {
  ToneMap curve = ToneMap::kSrgb;
  float stops = 0.0f; ///< [-32, 32]: radiance is multiplied by 2^stops
};

/// Display values in [0, 1], sRGB-encoded, of linear radiance. kSrgb clips at 1. kAces rolls highlights off.
/// Source: Narkowicz, ACES filmic tone mapping curve, 2015 (a fit of the ACES reference transforms).
Vec3 display_of_radiance(Vec3 radiance, const Exposure& exposure);

} // namespace packtrace
