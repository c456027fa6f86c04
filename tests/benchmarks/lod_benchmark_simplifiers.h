#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A mesh of positions and triangles only.
struct BareMesh {
  std::vector<DVec3> positions;
  std::vector<Triangle> triangles;
};

struct SimplifierResult {
  BareMesh mesh;
  double seconds = 0.0;        ///< CPU time of this thread
  uint64_t lost_triangles = 0; ///< triangles that the library rejected
};

/// Simplifies the whole mesh to at most target_triangles if possible. Positions must be integers.
SimplifierResult simplify_with_packtrace(const BareMesh& mesh, uint32_t target_triangles);
/// meshopt_simplify() without an error limit.
SimplifierResult simplify_with_meshoptimizer(const BareMesh& mesh, uint32_t target_triangles);
/// DecimaterT with ModQuadric and ModNormalFlipping (90 degrees). Returns an empty mesh if OpenMesh cannot represent
/// the input.
SimplifierResult simplify_with_openmesh(const BareMesh& mesh, uint32_t target_triangles);

} // namespace packtrace
