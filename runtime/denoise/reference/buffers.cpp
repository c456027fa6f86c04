#include "runtime/denoise/reference/buffers.h"

#include <limits>

#include "runtime/denoise/simd.h"
#include "runtime/denoise/unit_component.h"

namespace packtrace::reference {
namespace {

PACKTRACE_AVX2_CLONES
void load_surface_row(int width, const float* __restrict z, const float* __restrict normal, float* __restrict out_z,
                      float* __restrict nx, float* __restrict ny, float* __restrict nz) {
  for (int x = 0; x < width; ++x) {
    const float cx = normal[3 * x], cy = normal[3 * x + 1], cz = normal[3 * x + 2];
    const bool good = is_unit_component(cx) & is_unit_component(cy) & is_unit_component(cz);
    const bool hit = (z[x] >= std::numeric_limits<float>::min()) & (z[x] <= std::numeric_limits<float>::max());
    out_z[x] = hit ? smaller(z[x], kLargestDepth) : 0.0f;
    nx[x] = good ? cx : 0.0f;
    ny[x] = good ? cy : 0.0f;
    nz[x] = good ? cz : 0.0f;
  }
}

} // namespace

void Surfaces::resize(ImageSize new_size) {
  size = new_size;
  z.resize(size), normal_x.resize(size), normal_y.resize(size), normal_z.resize(size);
}

void Surfaces::load(const GBuffer& gbuffer) {
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const size_t begin = static_cast<size_t>(y) * size.width;
      load_surface_row(static_cast<int>(size.width), &gbuffer.view_z[begin], &gbuffer.normal[begin].x, z.row(y),
                       normal_x.row(y), normal_y.row(y), normal_z.row(y));
    }
  });
}

void History::clear(ImageSize size) {
  for (Plane<float>* plane : {&mean, &square, &distance, &tspp}) plane->clear();
  for (int y = 0; y < static_cast<int>(size.height); ++y) std::fill_n(value.row(y), size.width, kInvalidAo);
}

} // namespace packtrace::reference
