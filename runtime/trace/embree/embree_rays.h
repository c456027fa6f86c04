#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include <embree3/rtcore.h>
#include <xmmintrin.h>

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// The context of a query, with Embree's flag for the order of rays.
struct EmbreeQuery : RTCIntersectContext {
  explicit EmbreeQuery(RTCIntersectContextFlags order) {
    rtcInitIntersectContext(this);
    flags = order;
  }
};

static_assert(sizeof(Ray) == 32 && offsetof(Ray, tnear) == 12 && offsetof(Ray, direction) == 16 &&
              offsetof(Ray, tfar) == 28);

inline void set_ray(const Ray& in, uint32_t ray_class, RTCRay& out) {
  out.org_x = in.origin.x, out.org_y = in.origin.y, out.org_z = in.origin.z, out.tnear = in.tnear;
  out.dir_x = in.direction.x, out.dir_y = in.direction.y, out.dir_z = in.direction.z, out.time = 0.0f;
  out.tfar = in.tfar, out.mask = ray_class, out.id = 0, out.flags = 0;
}

inline void set_ray(const Ray& in, uint32_t ray_class, RTCRayHit& out) {
  set_ray(in, ray_class, out.ray);
  out.hit.geomID = out.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

/// Transposes up to 16 rays into an Embree packet and marks the valid lanes.
struct RayPacket16 {
  static constexpr size_t kRays = 16;
  alignas(64) int valid[kRays];

  /// @param rays 1 to 16 rays; a ray with tfar < tnear is not valid
  void load(std::span<const Ray> rays, RTCRay16& out) {
    constexpr size_t kRow = sizeof(Ray) / sizeof(float);
    alignas(64) Ray padded[kRays];
    const Ray* from = rays.data();
    if (rays.size() < kRays) {
      std::copy(rays.begin(), rays.end(), padded);
      from = padded;
    }
    for (size_t i = 0; i < kRays; i += 4) {
      store_columns(&from[i].origin.x, kRow, out.org_x + i, out.org_y + i, out.org_z + i, out.tnear + i);
      store_columns(&from[i].direction.x, kRow, out.dir_x + i, out.dir_y + i, out.dir_z + i, out.tfar + i);
    }
    for (size_t i = 0; i < kRays; ++i) valid[i] = i < rays.size() && out.tnear[i] <= out.tfar[i] ? -1 : 0;
  }

private:
  /// Transposes four rows (x, y, z, w) into columns.
  static void store_columns(const float* rows, size_t stride, float* x, float* y, float* z, float* w) {
    __m128 a = _mm_loadu_ps(rows), b = _mm_loadu_ps(rows + stride), c = _mm_loadu_ps(rows + 2 * stride),
           d = _mm_loadu_ps(rows + 3 * stride);
    _MM_TRANSPOSE4_PS(a, b, c, d);
    _mm_store_ps(x, a), _mm_store_ps(y, b), _mm_store_ps(z, c), _mm_store_ps(w, d);
  }
};

/// Sets the fields that are the same for all packets of a query and that Embree does not change.
inline void set_constants(uint32_t ray_class, RTCRay16& ray) {
  std::fill_n(ray.time, RayPacket16::kRays, 0.0f);
  std::fill_n(ray.mask, RayPacket16::kRays, ray_class);
  std::fill_n(ray.id, RayPacket16::kRays, 0u);
  std::fill_n(ray.flags, RayPacket16::kRays, 0u);
}

inline void clear_hits(RTCHit16& hit) {
  std::fill_n(hit.geomID, RayPacket16::kRays, RTC_INVALID_GEOMETRY_ID);
  std::fill_n(hit.instID[0], RayPacket16::kRays, RTC_INVALID_GEOMETRY_ID);
}

} // namespace packtrace
