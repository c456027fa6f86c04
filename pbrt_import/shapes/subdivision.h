#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// Most triangles subdivide_loop gives: beyond it, Error(kLimitExceeded).
inline constexpr uint64_t kMaxSubdividedTriangles = uint64_t{1} << 26;

/// pbrt-v3's loopsubdiv: `levels` Loop subdivisions, then vertices pushed to the limit surface, with unit limit normals
/// on the side of cross(p1 - p0, p2 - p0); no uvs. Inner vertices and normals are exact, so they do not depend on
/// `levels`; at the boundary pbrt's masks are used, (a + 3p + b) / 5 for positions, which only approach the limit.
/// The result has 4^levels triangles per good input triangle, in the input's order, and the input's orientation;
/// triangles that repeat an index, leave the range or touch a point that is not finite are dropped and reported.
/// Where more than two triangles meet at an edge, or several fans at a point, or neighbours disagree in orientation,
/// the surface is cut there as if it had a boundary (reported); no triangle is lost.
/// @param points control points; @param triangles indices into them
/// @param dropped_triangles the number of dropped ones is added to it; may be null
/// @param memory grows by what each level takes, before it is taken; null: nobody counts
/// Throws MemoryError; Error(kLimitExceeded), before allocating, if the result would exceed kMaxSubdividedTriangles, and whatever
/// check_cancelled throws.
/// Source: Charles Loop, Smooth Subdivision Surfaces Based on Triangles, 1987; weights as in Physically Based
/// Rendering, 3rd edition, 2016, section 3.8.
Mesh subdivide_loop(std::span<const Vec3> points, std::span<const Triangle> triangles, uint32_t levels,
                    const ReportFn& report, uint64_t* dropped_triangles = nullptr,
                    const CheckCancelledFn& check_cancelled = {}, MemoryReservation* memory = nullptr);

} // namespace packtrace
