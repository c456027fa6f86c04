#pragma once

#include <cstdint>
#include <vector>

#include "pbrt_import/scene/camera_rays.h"

namespace packtrace {

class PackedTracer;

/// Traversal costs of the nearest hit of each camera ray, if the ray is traced alone. Rows top to bottom.
struct RayCosts {
  ImageSize size;
  std::vector<uint32_t> nodes, leaves; ///< of all trees
  std::vector<uint32_t> triangles;     ///< tested
};

/// Traces the rays of trace_primary() one by one. The result is the same for any number of threads.
RayCosts count_ray_costs(const PackedTracer& tracer, const PrimaryCamera& view);

} // namespace packtrace
