#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

using DTriangle = std::array<DVec3, 3>; ///< corners

double area_of(const DTriangle& t);
double longest_edge_of(const DTriangle& t);
/// Distance of the longest edge from the opposite corner; 0 where the triangle has no area.
double height_of(const DTriangle& t);

/// One of the triangles that stand for all of a geometry's.
struct SampleTriangle {
  DTriangle corners; ///< geometry space
  double weight = 1; ///< how many triangles it stands for
};

/// All triangles of a geometry that have area, or about max_count of them. Large triangles are taken before small ones,
/// half by area and half by number, and weighted so that sums over the sample estimate sums over the geometry.
/// Takes time for at most 2^20 triangles. Depends on its arguments only.
std::vector<SampleTriangle> sample_surface(const Scene& scene, const GeometryPlan& plan, size_t max_count);

} // namespace packtrace
