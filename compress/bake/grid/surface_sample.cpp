#include "compress/bake/grid/surface_sample.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

constexpr uint64_t kMaxLookedAt = uint64_t{1} << 20;

/// Visits every stride-th triangle of the geometry.
/// @param per_triangle takes a function that returns the triangle's corners
template <typename PerTriangle>
void for_each_triangle(const Scene& scene, const GeometryPlan& plan, uint64_t stride, const PerTriangle& per_triangle) {
  uint64_t skip = stride / 2;
  for (const GeometryPart& part : plan.parts) {
    const Mesh& mesh = scene.meshes[part.mesh];
    const PartMap place(part);
    uint64_t i = skip;
    for (; i < mesh.triangles.size(); i += stride)
      per_triangle([&] {
        DTriangle corners;
        for (size_t corner = 0; corner < 3; ++corner)
          corners[corner] = place(mesh.positions[mesh.triangles[i][static_cast<int>(corner)]]);
        return corners;
      });
    skip = i - mesh.triangles.size();
  }
}

} // namespace

double area_of(const DTriangle& t) { return 0.5 * glm::length(glm::cross(t[1] - t[0], t[2] - t[0])); }

double longest_edge_of(const DTriangle& t) {
  return std::max({glm::distance(t[0], t[1]), glm::distance(t[1], t[2]), glm::distance(t[2], t[0])});
}

double height_of(const DTriangle& t) {
  const double edge = longest_edge_of(t);
  return edge > 0.0 ? 2.0 * area_of(t) / edge : 0.0;
}

std::vector<SampleTriangle> sample_surface(const Scene& scene, const GeometryPlan& plan, size_t max_count) {
  uint64_t triangles = 0;
  for (const GeometryPart& part : plan.parts) triangles += scene.meshes[part.mesh].triangles.size();
  std::vector<SampleTriangle> sample;
  if (triangles <= max_count) {
    sample.reserve(triangles);
    for_each_triangle(scene, plan, 1, [&](const auto& corners) {
      if (const DTriangle t = corners(); area_of(t) > 0.0) sample.push_back({t, 1.0});
    });
    return sample;
  }
  const uint64_t stride = (triangles + kMaxLookedAt - 1) / kMaxLookedAt;
  std::vector<double> areas;
  areas.reserve(triangles / stride + 1);
  for_each_triangle(scene, plan, stride, [&](const auto& corners) { areas.push_back(area_of(corners())); });
  double total_area = 0.0, count = 0.0;
  for (const double area : areas)
    if (area > 0.0) total_area += area, count += 1.0;
  // Systematic sampling. Triangle i has the measure m_i = (area_i / total area + 1 / count) / 2, which sums to 1, and
  // marks lie at equal distances along the running sum. A triangle hit by n marks represents n / (m_i * marks)
  // triangles.
  const auto marks = static_cast<double>(max_count);
  double end = 0.5 / marks; // end of the running sum, relative to the next mark
  size_t next = 0;
  for_each_triangle(scene, plan, stride, [&](const auto& corners) {
    const double area = areas[next++];
    if (!(area > 0.0)) return;
    const double measure = 0.5 * (area / total_area + 1.0 / count);
    end += measure;
    const double hits = std::floor(end * marks);
    if (hits < 1.0) return;
    end -= hits / marks;
    sample.push_back({corners(), static_cast<double>(stride) * hits / (measure * marks)});
  });
  return sample;
}

} // namespace packtrace
