#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/line_cover.h"
#include "compress/bake/lod/bound/triangle_history.h"
#include "compress/bake/lod/cluster_lod.h"

namespace packtrace {

/// First number of new positions and vertices in a group's results; their final numbers are assigned when groups are
/// appended.
inline constexpr uint32_t kNewNumber = 1u << 31;
/// LodGroupInput::owner of positions that belong to several groups.
inline constexpr uint32_t kShared = ~0u - 1;

/// Groups that keep a larger share of their triangles become terminal.
inline constexpr double kWorthwhile = 0.85;

/// The clusters of a group and its constraints. Read only, as groups are simplified in parallel.
struct LodGroupInput {
  const QuantizedGeometry& geometry;
  LevelTriangles levels;
  std::vector<const LodCluster*> clusters;
  std::span<const uint32_t> seam_of_kind;
  std::span<const uint32_t> owner;          ///< per position: its group; kShared positions are locked
  std::span<const uint8_t> locked_for_ever; ///< per position: nonzero if locked at all levels
  const LineCover& lines;
  double kept;        ///< share of the triangles to keep
  double floor = 0.0; ///< lower limit of the error
};

/// The result of simplifying a group.
struct SimplifiedGroup {
  uint64_t source_triangles = 0;
  double error = 0.0;                        ///< lattice steps
  std::vector<LatticePoint> new_positions;   ///< numbered from kNewNumber
  std::vector<QuantizedVertex> new_vertices; ///< numbered from kNewNumber
  std::vector<Triangle> triangles;           ///< vertex numbers, cluster by cluster
  std::vector<double> errors;                ///< per triangle, lattice steps
  /// per triangle: end of its range in `below`, the group's triangles that it may represent
  std::vector<uint32_t> below_ends, below;
  std::vector<uint32_t> cluster_ends;
  std::vector<uint32_t> cluster_kinds;
};

/// Simplifies a group to the given share of its triangles, as far as locked positions allow, and splits the result into
/// clusters. Degenerate triangles are left out of the result; those not in LineCover count as source surface when
/// errors are measured.
SimplifiedGroup simplify_group(const LodGroupInput& input);

} // namespace packtrace
