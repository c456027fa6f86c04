#pragma once

#include <span>
#include <vector>

#include "runtime/frame/shaded_mean.h"

namespace packtrace {

/// Least albedo that direct light is taken relative to.
inline constexpr float kDarkAlbedo = 0.02f;
/// Divisor that removes the albedo from direct light before filtering and reprojection.
inline Vec3 light_base(Vec3 albedo) { return glm::max(albedo, Vec3(kDarkAlbedo)); }

/// Surfaces of the traced pixels, which guide the filter. One entry per pixel.
struct ShadedGuides {
  ImageSize size;
  std::span<const float> view_z;
  std::span<const Vec3> normal;
  std::span<const uint32_t> instance;
  std::span<const uint32_t> material; ///< of the last frame
  std::span<const Vec3> albedo;
  float still_frames = 1.0f; ///< frames since something moved, with this one
};

/// Removes noise of shaded pixels: direct light relative to the albedo, and what is seen by reflection and through
/// glass, each averaged over neighbours on the same surface and material whose luminances differ by no more than the
/// noise of their means explains. That noise is known from the pixels' histories, and from their neighbours while
/// histories are short; it falls with the number of frames, and the filter faster from the eighth still frame on, so a
/// still picture converges to the mean of its frames. Ambient light stays. The filter is a sequence of 3 x 3 kernels
/// with holes of 1, 2, 4 and 8 pixels. Results do not depend on the number of threads. Source: Schied et al.,
/// Spatiotemporal Variance-Guided Filtering, HPG 2017; Dammertz et al., Edge-Avoiding A-Trous Wavelet Transform for
/// fast Global Illumination Filtering, HPG 2010.
/// @param result receives as many elements
void filter_shading(std::span<const ShadedPixel> pixels, const ShadedGuides& guides, std::vector<ShadedPixel>& result);

} // namespace packtrace
