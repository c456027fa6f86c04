#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/grid/visible_surface.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Compares what the cameras see of the source and of the scene on lattices, at the centres of pixels. Edges that move
/// past a pixel's centre put another surface there: the side of a plate, or the gap behind it. This sees gaps and
/// plates within one mesh, however their triangles lie, and ignores everything that is hidden.
class MovedEdges {
public:
  /// Chooses what to draw. Environment cameras are skipped; of many cameras and instances, the first cameras and the
  /// largest instances are drawn, about 4 times the scene's triangles or 2^22 in total.
  /// @param cameras for images of kPromisedSize; must outlive this object
  MovedEdges(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
             std::span<const PrimaryCamera> cameras, Progress& progress);

  struct Change {
    /// Pixels that show another surface over the number that the promise allows; above 1, the lattice is too coarse.
    /// Proportional to the step. 0 as long as the image as a whole is within the limit.
    double excess = 0.0;
  };

  /// Returns the change per geometry, in the camera where it is largest.
  /// @param grids per geometry; all positions must fit them
  std::vector<Change> compare(std::span<const GeometryGrid> grids) const;

private:
  struct View {
    const PrimaryCamera* camera;
    std::vector<uint32_t> instances;
  };

  /// Adds the changes that a camera sees.
  void add_changes(const VisiblePoints& points, std::span<const GeometryGrid> grids, std::span<Change> changes) const;

  const Scene& scene_;
  const ScenePlan& plan_;
  Progress& progress_;
  std::vector<View> views_;
};

} // namespace packtrace
