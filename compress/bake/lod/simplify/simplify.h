#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Attributes of a corner, besides its point. At seams, corners at one point have different wedges.
struct Wedge {
  static constexpr uint32_t kNone = ~0u;
  DVec3 normal{};          ///< unit length
  uint32_t source = kNone; ///< vertex with this normal and these texture coordinates; kNone for an interpolated normal
};

/// A triangle that is simplified level by level.
struct LodTriangle {
  Triangle points;    ///< point numbers, distinct
  Triangle wedges;    ///< wedge numbers; Wedge::kNone where the kind has no attributes
  uint32_t kind = 0;  ///< seams between kinds with different seam_of_kind are mostly preserved
  double error = 0.0; ///< maximum two-sided distance from the part of the original surface that it represents
};

/// Input of simplify(), and its result. Coordinates are integers: lattice steps relative to a nearby origin. Moved
/// points are rounded to integers again.
struct SimplifyMesh {
  std::vector<DVec3> points;
  std::vector<uint8_t> locked; ///< per point: must not move or vanish
  std::vector<Wedge> wedges;
  std::vector<LodTriangle> triangles;
  std::vector<uint8_t> moved;       ///< result, per point
  std::vector<uint32_t> stands_for; ///< result, per point: the point that it was merged into
  std::vector<uint32_t> source;     ///< result, per triangle: its number in the input
  /// Result, per corner of the input triangles: the edge from it to the next corner. Edges are numbered from 0 without
  /// gaps and shared by all triangles at the edge. Empty if there was nothing to simplify.
  std::vector<uint32_t> side_edges;
  std::vector<uint32_t> edge_became; ///< result, per edge: the edge that it was merged into
};

struct SimplifyConfig {
  uint32_t target_triangles = 0;
  std::span<const uint32_t> seam_of_kind; ///< per kind: edges between kinds with equal values (materials) are no seams
  bool keep_points = false; ///< place points at existing points only, as texture coordinates belong to them
};

/// Collapses edges in order of increasing cost until `target_triangles` are left or no edge can collapse. Locked points
/// and the edges between them stay, so the triangles' signed boundary there is preserved for any input (non-manifold,
/// duplicates, soup). No connected piece vanishes; holes through a piece may close, and a piece may come to touch
/// itself. Does not update the triangles' errors; see bound_errors(). Deterministic. Takes n log n time in the number
/// of triangles, if no point has very many.
void simplify(SimplifyMesh& mesh, const SimplifyConfig& config);

} // namespace packtrace
