#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/base/progress.h"
#include "runtime/measure/histogram.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

class BakedFile;

/// Distances from sampled points of one surface to the other surface, world units.
struct SurfaceDistance {
  double max = 0.0, mean = 0.0, rms = 0.0;
};

struct GeometryError {
  std::string name;
  uint32_t geometry = 0; ///< number in the baked file
  uint64_t triangles = 0, bytes = 0;
  double max_distance = 0.0; ///< larger of both directions, world units
  double max_normal_degrees = 0.0;
};

/// Differences between the surfaces of a baked file and those of its source.
struct SurfaceError {
  SurfaceDistance to_packed; ///< from points of the source
  SurfaceDistance to_source; ///< from points of the packed surface
  uint64_t samples = 0;      ///< in each direction
  double samples_per_area = 0.0;
  double max_normal_degrees = 0.0, mean_normal_degrees = 0.0; ///< angle of shading normals, at most 90, both directions
  Histogram distance, normal;                                 ///< over the samples of both directions
  std::vector<GeometryError> geometries;                      ///< by number of the file's geometry
  uint64_t missing_geometries = 0;                            ///< source geometries of which nothing is stored
};

/// Compares level 0 of a baked file with the source of its scene. Points are sampled uniformly by area, at least 16 per
/// geometry and direction, and compared with the same geometry of the other side. Instances with equal geometries on
/// both sides are compared once, under the largest transform, and weigh by their number. Near creases the nearest point
/// may lie beyond the crease, so the largest normal angle is an upper estimate.
/// The result does not depend on the number of threads.
/// @param source,packed views of the imported scene and of `file`
/// @param sample_count number of samples in each direction, at least 1; about
/// Throws Error(kInput) if the instances of both differ in number; MemoryError; Error(kCancelled).
SurfaceError surface_error(const SceneSource& source, const SceneSource& packed, const BakedFile& file,
                           uint64_t sample_count, const MemoryBudget& memory, Progress& progress);

/// Keys distance, normal, histograms {position, normal}, worst_geometries and missing_geometries (docs/measure.md).
nlohmann::json to_json(const SurfaceError& error);

} // namespace packtrace
