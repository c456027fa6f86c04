#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "pbrt_import/scene/camera_rays.h"
#include "pbrt_import/scene/scene.h"
#include "runtime/measure/stability_cases.h"

namespace packtrace {

/// A triangle in world space.
struct WorldTriangle {
  DVec3 a, b, c;
};

/// All triangles of a scene's shapes, placed in double precision.
std::vector<WorldTriangle> world_triangles(const Scene& scene);

/// Distance to the nearest triangle along a ray in lengths of its direction, or infinity. Tests every triangle with
/// edge functions in extended precision; edges belong to the triangle.
double exact_distance(const CameraRay& ray, std::span<const WorldTriangle> triangles);

/// Result of a case with default options. Counts are pixels or rays of the picture.
struct StabilityResult {
  std::string name;
  uint32_t triangles = 0, pixels = 0, hits = 0; ///< hits: pixels that show a surface in double precision
  uint32_t wrong_pixels = 0;                    ///< hit or miss differs from the source floats in double precision
  uint32_t wrong_depths = 0;                    ///< both hit, but depths differ by more than 1e-3 of the depth
  /// Mean error of occlusion: against 1 for convex shapes, 0 for closed ones, else against the floats with Embree.
  double ao_mae = 0.0;
  uint32_t self_intersections = 0; ///< occlusion rays that hit a convex shape from outside
  uint32_t leaks = 0;              ///< occlusion rays that leave a closed shape
  bool warned = false;             ///< the bake warned that its default precision may not suffice
};

/// An element of "stability" in a report (docs/measure.md).
nlohmann::json to_json(const StabilityResult& result);

/// Bakes a case with default options and renders it with the packed tracer. Deterministic.
StabilityResult measure_stability(const StabilityCase& stability_case);

} // namespace packtrace
