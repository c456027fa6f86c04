#pragma once

#include <cstdint>

#include "runtime/camera/gbuffer.h"
#include "runtime/camera/ray_columns.h"

namespace packtrace {

/// Neighbouring elements of columns, for neighbouring pixels of a row.
struct ColumnRow {
  uint32_t first, count;
};

/// Each function writes values of the hits of a row to out[0, row.count), and the default value for misses.
void write_depths(const RayColumns& columns, ColumnRow row, float* out);
void write_numbers(const double (&from)[kMaxColumnRays], const RayColumns& columns, ColumnRow row, float* out);
void write_vectors(const VectorColumns& from, const RayColumns& columns, ColumnRow row, Vec3* out);
void write_normals(const RayColumns& columns, ColumnRow row, Vec3* out);
void write_back_faces(const RayColumns& columns, ColumnRow row, uint8_t* out);
void write_motion(const RayColumns& columns, ColumnRow row, Vec2* out);
/// @param of_triangles values by triangle
void write_of_triangles(const uint32_t* of_triangles, uint32_t of_miss, const RayColumns& columns, ColumnRow row,
                        uint32_t* out);

} // namespace packtrace
