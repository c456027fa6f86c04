#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

using DTriangle = std::array<DVec3, 3>; ///< corners

/// Area of a triangle.
double area_of(const DTriangle& t);
/// Length of a triangle's longest edge.
double longest_edge_of(const DTriangle& t);
/// Distance of the longest edge from the opposite corner; 0 if the triangle has no area.
double height_of(const DTriangle& t);

/// A triangle of a sample that represents all triangles of a geometry.
struct SampleTriangle {
  DTriangle corners; ///< geometry space
  double weight = 1; ///< number of triangles that it represents
};

/// Returns all triangles of a geometry that have area, or a weighted sample of about max_count of them. The probability
/// of a triangle is the mean of a constant and of its share of the area. The sum of weight * f over the sample
/// estimates the sum of f over the geometry. Looks at 2^20 triangles at most. Depends on its arguments only.
std::vector<SampleTriangle> sample_surface(const Scene& scene, const GeometryPlan& plan, size_t max_count);

} // namespace packtrace
