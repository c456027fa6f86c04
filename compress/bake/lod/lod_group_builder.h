#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/cluster_lod.h"
#include "compress/bake/lod/bound/line_cover.h"
#include "compress/bake/lod/bound/triangle_history.h"

namespace packtrace {

/// In results that are made before it is known how many positions and vertices come before: the first new one is this.
inline constexpr uint32_t kNewNumber = 1u << 31;
/// LodGroupInput::owner of positions that several groups have.
inline constexpr uint32_t kShared = ~0u - 1;

/// Groups that keep more of their triangles are left as they are.
inline constexpr double kWorthwhile = 0.85;

/// The clusters of a group, and what its surroundings ask for. Everything is read only: groups are simplified in
/// parallel.
struct LodGroupInput {
  const QuantizedGeometry& geometry;
  LevelTriangles levels;
  std::vector<const LodCluster*> clusters;
  std::span<const uint32_t> seam_of_kind;
  std::span<const uint32_t> owner;          ///< per position; kShared ones stay
  std::span<const uint8_t> locked_for_ever; ///< per position; those stay too
  const LineCover& lines;
  double kept;        ///< share of the triangles that the group is to keep
  double floor = 0.0; ///< the error is not below, whatever is measured
};

/// What a group became.
struct SimplifiedGroup {
  uint64_t source_triangles = 0;
  double error = 0.0;                        ///< lattice steps
  std::vector<LatticePoint> new_positions;   ///< numbered from kNewNumber
  std::vector<QuantizedVertex> new_vertices; ///< numbered from kNewNumber
  std::vector<Triangle> triangles;           ///< vertices, cluster by cluster
  std::vector<double> errors;                ///< of each
  std::vector<uint32_t> below_ends, below;   ///< of each: triangles of the group that it may stand for
  std::vector<uint32_t> cluster_ends;
  std::vector<uint32_t> cluster_kinds;
};

/// Reduces the triangles of a group to the share asked for as far as its locked positions allow, and splits the result
/// into clusters. Triangles with two corners in one place are left out; the lines that they were count as surface of
/// the group, unless they are sides of other triangles.
SimplifiedGroup simplify_group(const LodGroupInput& input);

} // namespace packtrace
