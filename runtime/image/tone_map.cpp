#include "runtime/image/tone_map.h"

#include <algorithm>
#include <cmath>

#include "runtime/image/image.h"

namespace packtrace {
namespace {

float aces(float x) {
  // The curve is a ratio of polynomials that tends to 2.51 / 2.43 for large values.
  x = std::min(x, 1e6f);
  return (x * (2.51f * x + 0.03f)) / (x * (2.43f * x + 0.59f) + 0.14f);
}

} // namespace

Vec3 display_of_radiance(Vec3 radiance, const Exposure& exposure) {
  Vec3 display;
  for (int c = 0; c < 3; ++c) {
    const float exposed = radiance[c] * std::exp2(exposure.stops);
    const float curved = exposure.curve == ToneMap::kAces ? aces(std::max(exposed, 0.0f)) : exposed;
    display[c] = srgb_from_linear(std::clamp(curved, 0.0f, 1.0f));
  }
  return display;
}

} // namespace packtrace
