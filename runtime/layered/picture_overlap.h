#pragma once

#include <vector>

#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// Surfaces by which two consecutive pictures are compared.
struct PictureSurfaces {
  ImageSize size;
  std::vector<float> view_z; ///< 0 = background
  std::vector<Vec3> normal;
};

/// Fraction of a picture's surfaces that a previous picture of the same size shows at the place given by the motion, at
/// a similar depth (within 10 %) and with a similar normal (within 60 degrees), in [0, 1]. 0 without surfaces.
double shared_surfaces(const PictureSurfaces& previous, const GBuffer& now);

} // namespace packtrace
