#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// A G-buffer of half the width and height, rounded up. Each of its pixels is a copy of one pixel of a block of 2 x 2
/// full pixels, preferably the top left one. Another pixel is chosen if its similarity to the pixels of the
/// neighbouring blocks is much lower. So a surface one pixel wide gets samples of its own, while the surface behind it
/// is sampled in the neighbouring blocks.
struct HalfGBuffer {
  GBuffer gbuffer;
  std::vector<uint32_t> pixel; ///< full pixel of each half pixel
};

/// Selects the pixels. A block has no surface only if all its pixels miss.
HalfGBuffer halve(const GBuffer& full);

/// Joint bilateral upsampling: each pixel is the weighted mean of the nearest half pixels. The weight falls with the
/// distance in the picture (a tent two pixels wide), with the angle between the shading normals, and with the angle
/// between the line that connects the two points and their surfaces, which is 0 within a plane whatever the slope, and
/// near 90 degrees across a step in depth. Neither angle depends on the camera or the scene's scale. A pixel that is
/// not similar to any half pixel of the 5 x 5 nearest blocks gets a mean of them all, weighted towards the least
/// different. Source: Kopf, Cohen, Lischinski, Uyttendaele, "Joint bilateral upsampling" (2007).
/// @param full the G-buffer that `half` was made from
/// @tparam kLayers number of layers, 1 or 2
/// @param layers of one value per half pixel; negative ones are left out
/// @return one value per full pixel, within the range of the values; kInvalidAo where no surface or no value is
template <size_t kLayers>
std::array<std::vector<float>, kLayers> upsample_ao(const GBuffer& full, const HalfGBuffer& half,
                                                    const std::array<std::span<const float>, kLayers>& layers);

} // namespace packtrace
