#pragma once

#include <span>
#include <vector>

#include "compress/bake/clusters/geometry_clusters.h"
#include "compress/format/cluster/normal_codec.h"

namespace packtrace {

/// Returns the largest angle in degrees by which normals of a level may be wrong. Triangles with edges of length L that
/// are off by e turn by about atan(4 e / L), as the chords of an arc do. A quarter of that is allowed where at least
/// three quarters of the smooth surface turn by as much. Returns 0 if no triangle has normals.
/// @param level clusters of one level above 0
/// @param errors per cluster, in lattice steps
double level_normal_limit(const QuantizedGeometry& geometry, const GeometryClusters& level,
                          std::span<const double> errors);

/// The vertices of a level with their normals in an encoding of fewer bits.
struct CoarseNormals {
  NormalEncoding encoding = NormalEncoding::kAxis24;
  std::vector<QuantizedVertex> vertices; ///< empty if the level keeps the geometry's encoding
  /// Angles to the normals in the geometry's encoding.
  double max_error_degrees = 0.0, mean_error_degrees = 0.0;
};

/// Chooses the encoding of fewest bits whose largest error, for any direction, is within the limit.
/// @param level clusters of one level; their triangles get the new vertex numbers if the encoding changes
CoarseNormals coarsen_normals(double limit_degrees, const QuantizedGeometry& geometry, GeometryClusters& level);

} // namespace packtrace
