#include "compress/bake/grid/grid_check.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "pbrt_import/base/weighted_quantile.h"
#include "pbrt_import/scene/angle.h"

namespace packtrace {
namespace {

DVec3 normal_of(const DTriangle& t) {
  const DVec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double length = glm::length(normal);
  return length > 0.0 ? normal / length : DVec3(0.0);
}

} // namespace

GridCheck check_grid(const GeometryView& view, const GeometryGrid& grid) {
  GridCheck check;
  const double step = grid.grid.step();
  const bool seen = view.best.pixels > 0.0;
  std::vector<std::pair<double, double>> tilts; // degrees, weight
  tilts.reserve(view.sample.size());
  double total = 0.0, collapsed = 0.0, kept = 0.0;
  for (size_t i = 0; i < view.sample.size(); ++i) {
    const SampleTriangle& t = view.sample[i];
    const double weight = seen ? view.sample_pixels[i] : t.weight * area_of(t.corners);
    DTriangle lattice; // relative to the first corner; differences of lattice coordinates are exact
    LatticePoint first;
    for (size_t corner = 0; corner < 3; ++corner) {
      const LatticePoint q = grid.round(t.corners[corner]);
      if (corner == 0) first = q;
      for (size_t axis = 0; axis < 3; ++axis) {
        const int a = static_cast<int>(axis);
        lattice[corner][a] = static_cast<double>(q[axis] - first[axis]);
        const double moved = static_cast<double>(from_lattice(q[axis], step)) -
                             static_cast<double>(static_cast<float>(t.corners[corner][a]));
        check.moved = std::max(check.moved, std::abs(moved));
      }
    }
    total += weight;
    const DVec3 normal = normal_of(lattice), source = normal_of(t.corners);
    if (normal == DVec3(0.0)) {
      collapsed += weight;
    } else if (source != DVec3(0.0)) {
      tilts.emplace_back(angle_degrees(normal, source), weight);
      kept += weight;
    }
  }
  if (seen && total > 0.0) check.collapsed = collapsed / total * view.best.coverage();
  double sum = 0.0;
  for (const auto& [degrees, weight] : tilts) sum += degrees * weight;
  if (kept > 0.0) check.mean_tilt_degrees = sum / kept;
  check.tilt_degrees = weighted_quantile(tilts, 0.99 * kept);
  return check;
}

} // namespace packtrace
