#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/grid/visible_surface.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Compares what the cameras see of the source and of the scene on lattices, at the centres of pixels.
/// - Edges that move past a pixel's centre put another surface there: the side of a plate, or the gap behind it.
/// - Gaps that change their width change in brightness.
/// Gaps and plates count within one mesh as well as between meshes; hidden surfaces do not count.
class VisibleChanges {
public:
  /// Chooses what to draw: of many cameras and instances, the first cameras and the largest instances, about 4 times
  /// the scene's triangles or 2^22 in total. Environment cameras are drawn as the six faces of a cube.
  /// @param cameras for images of kPromisedSize
  VisibleChanges(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                 std::span<const PrimaryCamera> cameras, Progress& progress);

  /// Changes relative to what the promise allows: above 1, the lattice is too coarse. Proportional to the step; 0 if
  /// the image as a whole is within the limit.
  struct Change {
    double edges = 0.0; ///< of the number of pixels that show another surface
    double gaps = 0.0;  ///< of the width of gaps in front of visible surfaces, on average
    double excess() const { return std::max(edges, gaps); }
  };

  /// Returns the change per geometry, the largest of all cameras.
  /// @param grids per geometry; all positions must fit them
  std::vector<Change> compare(std::span<const GeometryGrid> grids) const;

private:
  struct View {
    std::vector<PrimaryCamera> images; ///< one, or the faces of a cube
    std::vector<uint32_t> instances;
  };
  struct Sums;

  void add_edges(const VisiblePoints& points, std::span<const GeometryGrid> grids, std::vector<Sums>& sums) const;
  static void add_gaps(std::span<const VisiblePoint> points, std::span<const float> changes, std::vector<Sums>& sums);
  /// Adds the changes that a camera sees.
  static void add_changes(std::span<const Sums> sums, std::span<Change> changes);

  const Scene& scene_;
  const ScenePlan& plan_;
  Progress& progress_;
  std::vector<View> views_;
};

} // namespace packtrace
