#include "compress/bake/grid/stated_grids.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

/// The grid with exactly this step, if there is one.
std::optional<PositionGrid> grid_of_step(double step) {
  if (!(step > 0.0) || !std::isfinite(step)) return std::nullopt;
  int exponent = 0;
  const double mantissa = std::frexp(step, &exponent) * 16.0; // 8..16
  exponent -= 4;
  if (mantissa != std::floor(mantissa) || exponent < kMinStepExponent || exponent > kMaxStepExponent)
    return std::nullopt;
  return PositionGrid{static_cast<uint32_t>(mantissa), exponent};
}

/// The lattice of a part in its geometry's space.
std::optional<PositionGrid> grid_of_part(const Mesh& mesh, const DAffine& map) {
  if (mesh.lattice.mantissa == 0) return std::nullopt;
  const double scale = std::abs(map[0].x);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      if (std::abs(map[column][row]) != (column == row ? scale : 0.0)) return std::nullopt;
  const double step = PositionGrid{mesh.lattice.mantissa, mesh.lattice.exponent}.step() * scale;
  for (int axis = 0; axis < 3; ++axis) {
    const double steps = map[3][axis] / step;
    constexpr double kWholeStep = 1e-3;
    if (!(std::abs(steps - std::round(steps)) <= kWholeStep)) return std::nullopt;
  }
  return grid_of_step(step);
}

std::optional<PositionGrid> grid_of(const Scene& scene, const GeometryPlan& plan) {
  std::optional<PositionGrid> common;
  for (const GeometryPart& part : plan.parts) {
    const std::optional<PositionGrid> grid = grid_of_part(scene.meshes[part.mesh], part.geometry_from_mesh);
    if (!grid || (common && *common != *grid)) return std::nullopt;
    common = grid;
  }
  return common;
}

} // namespace

StatedGrids stated_grids(const Scene& scene, const ScenePlan& plan) {
  StatedGrids stated;
  constexpr int32_t kMaxHalvings = 62; // coordinates on the coarsest grid times 2^halvings fit 64 bits
  bool agree = true;
  for (const GeometryPlan& geometry : plan.geometries) {
    const std::optional<PositionGrid>& grid = stated.grids.emplace_back(grid_of(scene, geometry));
    if (!geometry.world_space || geometry.parts.empty()) continue;
    if (!grid || (stated.world && stated.world->mantissa != grid->mantissa)) {
      agree = false;
    } else if (!stated.world || stated.world->exponent < grid->exponent) {
      stated.world = grid;
    }
  }
  for (size_t g = 0; g < plan.geometries.size(); ++g)
    if (plan.geometries[g].world_space && stated.grids[g] && stated.world)
      agree &= stated.world->exponent - stated.grids[g]->exponent <= kMaxHalvings;
  if (agree) return stated;
  stated.world.reset();
  for (size_t g = 0; g < plan.geometries.size(); ++g)
    if (plan.geometries[g].world_space) stated.grids[g].reset();
  return stated;
}

} // namespace packtrace
