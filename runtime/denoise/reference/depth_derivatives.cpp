#include "runtime/denoise/reference/depth_derivatives.h"

#include "runtime/denoise/depth_derivatives.h"

namespace packtrace::reference {
void derive_depth(const Surfaces& surfaces, Derivatives& derivatives) {
  const Plane<float>& z = surfaces.z;
  for_row_blocks(surfaces.size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y)
      derive_row(static_cast<int>(surfaces.size.width), z.row(y - 1), z.row(y), z.row(y + 1), derivatives.x.row(y),
                 derivatives.y.row(y));
  });
}

} // namespace packtrace::reference
