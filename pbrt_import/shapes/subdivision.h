#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// Largest number of triangles that subdivide_loop() returns; beyond it, it throws Error(kLimitExceeded).
inline constexpr uint64_t kMaxSubdividedTriangles = uint64_t{1} << 26;

/// pbrt-v3's loopsubdiv: applies `levels` Loop subdivisions and moves the vertices to the limit surface, with unit
/// limit normals on the side of cross(p1 - p0, p2 - p0); no uvs. Interior vertices and normals are exact, so they do
/// not depend on `levels`. At the boundary pbrt's masks are used, (a + 3p + b) / 5 for positions, which only approach
/// the limit.
///
/// The result has 4^levels triangles per valid input triangle, in the order and orientation of the input. Triangles
/// with a repeated index, an index out of range or a non-finite point are dropped and reported. If more than two
/// triangles share an edge, several fans share a point or neighbours disagree in orientation, the surface is cut there
/// as if it had a boundary (reported), without losing triangles.
/// @param points control points
/// @param triangles indices into points
/// @param dropped_triangles incremented by the number of dropped triangles; may be null
/// @param memory grows by the memory of the finest level, before it is allocated; null: not counted
/// Throws MemoryError; Error(kLimitExceeded), before allocating, if the result would exceed kMaxSubdividedTriangles;
/// and what check_cancelled throws.
/// Source: Charles Loop, Smooth Subdivision Surfaces Based on Triangles, 1987; weights as in Physically Based
/// Rendering, 3rd edition, 2016, section 3.8.
Mesh subdivide_loop(std::span<const Vec3> points, std::span<const Triangle> triangles, uint32_t levels,
                    const ReportFn& report, uint64_t* dropped_triangles = nullptr,
                    const CheckCancelledFn& check_cancelled = {}, MemoryReservation* memory = nullptr);

} // namespace packtrace
