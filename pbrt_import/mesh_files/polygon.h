#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Splits a polygon into triangles that cover it, also where it is concave. Quadrilaterals are cut along the diagonal
/// that lies inside; polygons with more corners lose their ears one by one; those with more than kMaxEarCorners corners
/// and those without area become fans.
/// @param corners at least 3 points in order; nearly planar
/// @param triangles receives corners.size() - 2 triples of corner numbers, with the polygon's orientation
/// Source: G. Meisters, Polygons have ears, The American Mathematical Monthly 82, 1975.
void triangulate_polygon(std::span<const Vec3> corners, std::vector<std::array<uint32_t, 3>>& triangles);

inline constexpr size_t kMaxEarCorners = 1024; ///< removing ears takes quadratic time

} // namespace packtrace
