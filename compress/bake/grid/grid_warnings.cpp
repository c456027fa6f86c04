#include "compress/bake/grid/grid_warnings.h"

#include <algorithm>

#include "compress/bake/bake_config.h"
#include "compress/bake/grid/float_spacing.h"
#include "pbrt_import/base/brief.h"

namespace packtrace {
namespace {

/// Hit positions are world-space floats in every backend, and mesh positions are floats in mesh space. Both lose
/// accuracy far from the origin.
void add_coarse_floats(const Scene& scene, std::vector<std::string>& warnings) {
  constexpr double kMaxSpacing = 1.0 / 512.0; // of the scene's diagonal; at half of it, images are right to 0.002 AO
  const Bounds world = world_bounds(scene);
  if (world.empty()) return;
  const double spacing = std::max(float_spacing(world), largest_mesh_spacing(scene)), diagonal = world.diagonal();
  if (diagonal > 0.0 && spacing > kMaxSpacing * diagonal)
    warnings.push_back("the scene lies so far from the origin that floats are " + brief(spacing) + " apart there, " +
                       brief(100.0 * spacing / diagonal) +
                       " % of its diagonal; move it closer, or pictures will be wrong");
}

} // namespace

std::vector<std::string> grid_warnings(const Scene& scene, const SceneMeasure& measure,
                                       std::span<const GeometryGrid> grids) {
  uint64_t coarse = 0, far = 0;
  for (size_t i = 0; i < grids.size(); ++i) {
    const GeometryMeasure& geometry = measure.geometries[i];
    if (geometry.bounds.empty()) continue;
    const double step = grids[i].grid.step();
    coarse += geometry.median_edge > 0.0 && step > geometry.median_edge * kRoughEdge;
    far += geometry.float_step() > step;
  }
  std::vector<std::string> warnings;
  if (coarse > 0)
    warnings.push_back(std::to_string(coarse) + " of " + std::to_string(grids.size()) +
                       " geometries have a step above an eighth of their median edge; surfaces will look rough");
  if (far > 0)
    warnings.push_back(
        std::to_string(far) + " of " + std::to_string(grids.size()) +
        " geometries lie so far from the origin that float positions are coarser than the step of their grid");
  add_coarse_floats(scene, warnings);
  return warnings;
}

} // namespace packtrace
