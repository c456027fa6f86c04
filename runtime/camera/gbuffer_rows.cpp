#include "runtime/camera/gbuffer_rows.h"

#include <limits>

#include "runtime/simd.h"

namespace packtrace {

PACKTRACE_AVX2_CLONES
void write_depths(const RayColumns& columns, ColumnRow row, float* out) {
  const double* const from = columns.view_z + row.first;
  const int32_t* const hit = columns.hit + row.first;
#pragma GCC ivdep
  for (uint32_t i = 0; i < row.count; ++i)
    out[i] = hit[i] != 0 ? larger(static_cast<float>(from[i]), std::numeric_limits<float>::denorm_min()) : 0.0f;
}

PACKTRACE_AVX2_CLONES
void write_numbers(const double (&numbers)[kMaxColumnRays], const RayColumns& columns, ColumnRow row, float* out) {
  const double* const from = numbers + row.first;
  const int32_t* const hit = columns.hit + row.first;
#pragma GCC ivdep
  for (uint32_t i = 0; i < row.count; ++i) out[i] = hit[i] != 0 ? static_cast<float>(from[i]) : 0.0f;
}

PACKTRACE_AVX2_CLONES
void write_vectors(const VectorColumns& from, const RayColumns& columns, ColumnRow row, Vec3* out) {
  const double *const x = from.x + row.first, *const y = from.y + row.first, *const z = from.z + row.first;
  const int32_t* const hit = columns.hit + row.first;
#pragma GCC ivdep
  for (uint32_t i = 0; i < row.count; ++i) {
    out[i].x = hit[i] != 0 ? static_cast<float>(x[i]) : 0.0f;
    out[i].y = hit[i] != 0 ? static_cast<float>(y[i]) : 0.0f;
    out[i].z = hit[i] != 0 ? static_cast<float>(z[i]) : 0.0f;
  }
}

PACKTRACE_AVX2_CLONES
void write_normals(const RayColumns& columns, ColumnRow row, Vec3* out) {
  const float *const x = columns.shading_normal[0] + row.first, *const y = columns.shading_normal[1] + row.first,
                     *const z = columns.shading_normal[2] + row.first;
  const int32_t* const hit = columns.hit + row.first;
#pragma GCC ivdep
  for (uint32_t i = 0; i < row.count; ++i) {
    out[i].x = hit[i] != 0 ? x[i] : 0.0f;
    out[i].y = hit[i] != 0 ? y[i] : 0.0f;
    out[i].z = hit[i] != 0 ? z[i] : 0.0f;
  }
}

PACKTRACE_AVX2_CLONES
void write_back_faces(const RayColumns& columns, ColumnRow row, uint8_t* out) {
  const double* const winding = columns.winding + row.first;
  const int32_t* const hit = columns.hit + row.first;
#pragma GCC ivdep
  for (uint32_t i = 0; i < row.count; ++i) out[i] = (hit[i] != 0) & (winding[i] < 0.0);
}

PACKTRACE_AVX2_CLONES
void write_motion(const RayColumns& columns, ColumnRow row, Vec2* out) {
  const double *const x = columns.motion_x + row.first, *const y = columns.motion_y + row.first;
  const int32_t* const hit = columns.hit + row.first;
#pragma GCC ivdep
  for (uint32_t i = 0; i < row.count; ++i) {
    out[i].x = hit[i] != 0 ? static_cast<float>(x[i]) : 0.0f;
    out[i].y = hit[i] != 0 ? static_cast<float>(y[i]) : 0.0f;
  }
}

PACKTRACE_AVX2_CLONES
void write_of_triangles(const uint32_t* of_triangles, uint32_t of_miss, const RayColumns& columns, ColumnRow row,
                        uint32_t* out) {
  const int32_t* const triangle = columns.triangle + row.first;
  const int32_t* const hit = columns.hit + row.first;
#pragma GCC ivdep
  for (uint32_t i = 0; i < row.count; ++i) {
    const uint32_t value = of_triangles[triangle[i]];
    out[i] = hit[i] != 0 ? value : of_miss;
  }
}

} // namespace packtrace
