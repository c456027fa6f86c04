#include "runtime/layered/picture_overlap.h"

#include <cassert>
#include <cmath>

namespace packtrace {
namespace {

/// Whether the previous picture shows the surface at a pixel of this one.
bool is_shared(const PictureSurfaces& previous, const GBuffer& now, uint32_t x, uint32_t y) {
  constexpr float kDepthTolerance = 0.1f, kMinCosine = 0.5f;
  const size_t at = size_t{y} * now.size.width + x;
  const float from_x = static_cast<float>(x) + 0.5f - now.motion_px[at].x;
  const float from_y = static_cast<float>(y) + 0.5f - now.motion_px[at].y;
  // False for NaN.
  if (!(from_x >= 0.0f && from_x < static_cast<float>(now.size.width) && from_y >= 0.0f &&
        from_y < static_cast<float>(now.size.height)))
    return false;
  const size_t from = static_cast<size_t>(from_y) * now.size.width + static_cast<size_t>(from_x);
  const float z = now.previous_z.empty() ? now.view_z[at] : now.previous_z[at];
  return previous.view_z[from] > 0.0f && std::abs(previous.view_z[from] - z) <= kDepthTolerance * z &&
         glm::dot(previous.normal[from], now.normal[at]) >= kMinCosine;
}

} // namespace

double shared_surfaces(const PictureSurfaces& previous, const GBuffer& now) {
  assert(previous.size == now.size);
  size_t surfaces = 0, shared = 0;
  for (uint32_t y = 0; y < now.size.height; ++y)
    for (uint32_t x = 0; x < now.size.width; ++x) {
      if (!(now.view_z[size_t{y} * now.size.width + x] > 0.0f)) continue;
      ++surfaces;
      shared += is_shared(previous, now, x, y);
    }
  return surfaces > 0 ? static_cast<double>(shared) / static_cast<double>(surfaces) : 0.0;
}

} // namespace packtrace
