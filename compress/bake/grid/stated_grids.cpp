#include "compress/bake/grid/stated_grids.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <tbb/parallel_for.h>

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

double step_of(const Mesh& mesh) { return PositionGrid{mesh.lattice.mantissa, mesh.lattice.exponent}.step(); }

double largest_coordinate(const Mesh& mesh) {
  double largest = 0.0;
  for (const Vec3& p : mesh.positions)
    for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(double{p[axis]}));
  return largest;
}

/// @param rounding error of decoded positions
bool lies_on_lattice(const Mesh& mesh, double rounding) {
  constexpr double kWholeStep = 0.125;
  const double step = step_of(mesh), tolerance = std::max(kWholeStep * step, rounding);
  return std::ranges::all_of(mesh.positions, [&](const Vec3& position) {
    for (int axis = 0; axis < 3; ++axis) {
      const double p = double{position[axis]};
      if (!(std::abs(p - std::round(p / step) * step) <= tolerance)) return false;
    }
    return true;
  });
}

/// By mesh: whether it lies on the lattice that it states.
std::vector<uint8_t> check_lattices(const Scene& scene) {
  const std::vector<Mesh>& meshes = scene.meshes;
  std::vector<double> largest(meshes.size());
  tbb::parallel_for(size_t{0}, meshes.size(), [&](size_t i) {
    if (meshes[i].lattice.mantissa != 0) largest[i] = largest_coordinate(meshes[i]);
  });
  std::map<double, double> reach; // by step: Draco's codes count from one origin, with errors relative to it
  for (size_t i = 0; i < meshes.size(); ++i)
    if (meshes[i].lattice.mantissa != 0) {
      double& most = reach[step_of(meshes[i])];
      most = std::max(most, largest[i]);
    }
  std::vector<uint8_t> on_lattice(meshes.size());
  tbb::parallel_for(size_t{0}, meshes.size(), [&](size_t i) {
    constexpr double kFloatRounding = 0x1p-22;
    on_lattice[i] =
        meshes[i].lattice.mantissa != 0 && lies_on_lattice(meshes[i], kFloatRounding * reach.at(step_of(meshes[i])));
  });
  return on_lattice;
}

/// The lattice of a part, which lies on it, in its geometry's space.
std::optional<PositionGrid> grid_of_part(const Mesh& mesh, const DAffine& map) {
  const double scale = std::abs(map[0].x);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      if (std::abs(map[column][row]) != (column == row ? scale : 0.0)) return std::nullopt;
  const double step = step_of(mesh) * scale;
  for (int axis = 0; axis < 3; ++axis) {
    const double steps = map[3][axis] / step;
    constexpr double kWholeStep = 1e-3;
    if (!(std::abs(steps - std::round(steps)) <= kWholeStep)) return std::nullopt;
  }
  return grid_of_step(step);
}

std::optional<PositionGrid> grid_of(const Scene& scene, const GeometryPlan& plan,
                                    const std::vector<uint8_t>& on_lattice) {
  std::optional<PositionGrid> common;
  for (const GeometryPart& part : plan.parts) {
    if (!on_lattice[part.mesh]) return std::nullopt;
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
  const std::vector<uint8_t> on_lattice = check_lattices(scene);
  for (size_t i = 0; i < scene.meshes.size(); ++i)
    stated.false_lattices += scene.meshes[i].lattice.mantissa != 0 && !on_lattice[i];
  for (const GeometryPlan& geometry : plan.geometries) {
    const std::optional<PositionGrid>& grid = stated.grids.emplace_back(grid_of(scene, geometry, on_lattice));
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
