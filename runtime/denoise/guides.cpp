#include "runtime/denoise/guides.h"

#include <atomic>
#include <cmath>

#include "runtime/denoise/simd.h"
#include "runtime/denoise/unit_component.h"

namespace packtrace {
namespace {

/// In kNormalUnit, rounded to nearest; 0 if the normal is not `good`.
inline int16_t component(bool good, float c) {
  const float bounded = smaller(larger(good ? c : 0.0f, -1.0f), 1.0f);
  return static_cast<int16_t>(static_cast<int>(bounded * (1.0f / kNormalUnit) + 16384.5f) - 16384);
}

PACKTRACE_AVX2_CLONES
void load_row(int width, const float* __restrict z, const float* __restrict normal, float* __restrict disparity,
              int16_t* __restrict nx, int16_t* __restrict ny, int16_t* __restrict nz) {
  for (int x = 0; x < width; ++x) {
    const float cx = normal[3 * x], cy = normal[3 * x + 1], cz = normal[3 * x + 2];
    const bool good = is_unit_component(cx) & is_unit_component(cy) & is_unit_component(cz);
    disparity[x] = disparity_of(z[x]);
    nx[x] = component(good, cx);
    ny[x] = component(good, cy);
    nz[x] = component(good, cz);
  }
}

/// Counts the pixels whose guides differ plus the motion components above kStillMotion; 0 means that the row is still.
PACKTRACE_AVX2_CLONES
int count_changes(int width, const float* __restrict z, const float* __restrict normal,
                  const uint32_t* __restrict instance, const float* __restrict motion,
                  const float* __restrict disparity, const int16_t* __restrict nx, const int16_t* __restrict ny,
                  const int16_t* __restrict nz, const uint32_t* __restrict old_instance) {
  int changes = 0;
  for (int x = 0; x < width; ++x) {
    const float cx = normal[3 * x], cy = normal[3 * x + 1], cz = normal[3 * x + 2];
    const bool good = is_unit_component(cx) & is_unit_component(cy) & is_unit_component(cz);
    const bool same = (disparity_of(z[x]) == disparity[x]) & (component(good, cx) == nx[x]) &
                      (component(good, cy) == ny[x]) & (component(good, cz) == nz[x]) &
                      (instance[x] == old_instance[x]);
    changes += same ? 0 : 1;
  }
  for (int i = 0; i < 2 * width; ++i) changes += std::abs(motion[i]) <= kStillMotion ? 0 : 1; // NaN counts as motion
  return changes;
}

} // namespace

void Guides::resize(ImageSize new_size) {
  size = new_size;
  disparity.resize(size), normal_x.resize(size), normal_y.resize(size), normal_z.resize(size), instance.resize(size);
}

void Guides::make_room(ImageSize new_size) {
  size = new_size;
  disparity.make_room(size), instance.make_room(size);
  normal_x.make_room(size), normal_y.make_room(size), normal_z.make_room(size);
}

void Guides::load(const GBuffer& gbuffer) {
  const int width = static_cast<int>(size.width);
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const size_t begin = static_cast<size_t>(y) * size.width;
      load_row(width, &gbuffer.view_z[begin], &gbuffer.normal[begin].x, disparity.row(y), normal_x.row(y),
               normal_y.row(y), normal_z.row(y));
      std::copy_n(&gbuffer.instance[begin], size.width, instance.row(y));
    }
  });
}

bool Guides::still_matches(const GBuffer& gbuffer) const {
  const int width = static_cast<int>(size.width);
  std::atomic<bool> still{true};
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last && still.load(std::memory_order_relaxed); ++y) {
      const size_t begin = static_cast<size_t>(y) * size.width;
      if (count_changes(width, &gbuffer.view_z[begin], &gbuffer.normal[begin].x, &gbuffer.instance[begin],
                        &gbuffer.motion_px[begin].x, disparity.row(y), normal_x.row(y), normal_y.row(y),
                        normal_z.row(y), instance.row(y)) != 0)
        still.store(false, std::memory_order_relaxed);
    }
  });
  return still.load();
}

} // namespace packtrace
