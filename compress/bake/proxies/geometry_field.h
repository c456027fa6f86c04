#pragma once

#include <cstdint>
#include <string>

#include "compress/bake/proxies/occluding_triangles.h"
#include "compress/bake/proxies/proxy_config.h"
#include "compress/format/voxels/distance_field.h"
#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// The distance field of a geometry.
struct GeometryField {
  DistanceField field;
  DVec3 origin{0.0}; ///< of sample (0, 0, 0), object space
  double edge = 1.0; ///< between samples, object units
  bool has_sign = false;
  uint64_t band_samples = 0; ///< samples within the band
  uint64_t repaired = 0;     ///< those of them whose distance jump flooding had wrong
};

/// Distances from the centres of a geometry's voxels, and of kFieldMargin voxels around them, to its triangles. Jump
/// flooding finds near triangles for all samples; then every triangle is compared with all samples that it may be
/// within the band of, so that the band is exact. Distances inside closed geometries are negative, unless parts of them
/// are too thin for samples inside: walls of 0.8 voxels or less, more than 2.5 voxels wide. Alpha masks are ignored.
/// Source: Rong and Tan, "Jump Flooding in GPU with Applications to Voronoi Diagram and Distance Transform", 2006, with
/// the additional first pass of step 1 (1+JFA).
/// @param source of at least one triangle
/// Throws MemoryError, with the largest number of voxels that fits the budget.
GeometryField build_field(const OccludingTriangles& source, const ProxyConfig& config, const MemoryBudget& budget,
                          const std::string& what);

} // namespace packtrace
