#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/grid/seam_gaps.h"
#include "compress/format/file/file_summary.h"
#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// A geometry whose images may differ from the source's by more than the default precision promises
/// (PrecisionKind::kPicture). Steps are in the geometry's own units.
struct BrokenPromise {
  std::string name;    ///< name of the geometry
  std::string bound;   ///< the bound that is exceeded: height, pixel, contact or outline (PictureBound)
  double wanted = 0.0; ///< the step that would satisfy the bound
  double step = 0.0;
  double scale = 1.0;       ///< scale of the largest instance: wanted * scale is a step in world units
  bool float_limit = false; ///< the step is already as fine as float spacing at the geometry's coordinates
};

/// Statistics of a bake. `file` is what summarize() returns for the written file.
struct BakeReport {
  FileSummary file;
  uint64_t source_triangles = 0;     ///< triangles of the scene, including unused objects
  uint64_t source_vertices = 0;      ///< source vertices of all stored geometries
  uint64_t merged_vertices = 0;      ///< source vertices that quantisation made equal to another one of their geometry
  uint64_t collapsed_triangles = 0;  ///< left out because they have no area on their grid
  uint64_t coinciding_triangles = 0; ///< left out because quantisation made them equal to another triangle
  uint64_t vanished_geometries = 0;  ///< geometries that have no triangles left
  /// Area of all placed triangles, world units squared; an estimate for instances with nonuniform scale.
  double source_area = 0.0;
  double collapsed_area = 0.0;   ///< source area of collapsed_triangles, with the same restriction
  uint64_t shared_shapes = 0;    ///< shapes outside objects that reuse the geometry of another shape
  uint64_t instanced_shapes = 0; ///< shapes outside objects with their own grid, because they share a geometry
  SeamSummary seams;             ///< seams of instances on their own grids
  uint64_t shared_objects = 0;   ///< objects that reuse the geometry of another one
  uint64_t unused_objects = 0;   ///< never instanced, so not stored
  uint64_t unused_triangles = 0;
  uint64_t left_out = 0;   ///< shapes and instances that exceed the float range; each is listed in the diagnostics
  double world_step = 0.0; ///< 0: no world-space geometry
  double world_median_edge = 0.0;
  uint64_t nested_geometries = 0; ///< small world-space geometries on finer grids than the scene's
  /// Geometries whose steps are finer than the median edge requires, because images need it.
  uint64_t finer_geometries = 0;
  std::vector<BrokenPromise> promise; ///< geometries that may break the default precision's promise; empty if none does
  double max_position_error = 0.0;    ///< measured against the source, largest over the axes, object units
  double rms_position_error = 0.0;    ///< root mean square over all source vertices and axes, object units
  double max_normal_error_degrees = 0.0, mean_normal_error_degrees = 0.0;
  double max_uv_error = 0.0;
  double max_uv_error_texels = 0.0;  ///< relative to the finest texture that the same geometry looks up
  uint64_t lod_candidates = 0;       ///< geometries for which BakeConfig requests LOD levels
  uint64_t lod_geometries = 0;       ///< geometries with LOD levels
  uint64_t resumed_geometries = 0;   ///< geometries whose LOD levels came from an interrupted bake
  std::vector<std::string> warnings; ///< also reported in the diagnostics
};

struct BakedScene {
  std::vector<std::byte> bytes; ///< the file
  BakeReport report;
};

/// Packs a scene. The bytes depend on the scene and the config only, not on thread count or time.
/// Shapes and instances that exceed the float range where they are placed are left out and reported as errors in the
/// diagnostics. Their instance numbers remain and refer to an empty geometry.
/// Throws MemoryError if packing may need more than config.memory; Error(kUsage) if the config is out of range;
/// Error(kInput) if the scene breaks the rules of scene.h, or if config.strict is set and something would be left out;
/// Error(kLimitExceeded) if a limit of the format is exceeded or the promised accuracy cannot be met;
/// Error(kCancelled);
/// Error(kIo) if config.resume cannot be used.
BakedScene bake_to_bytes(const Scene& scene, const BakeConfig& config, Diagnostics& diagnostics, Progress& progress);

/// Runs bake_to_bytes() and writes the result to a file. The file appears complete or not at all.
/// Also throws Error(kIo) if the output cannot be written, or exists and force is not set. Both are checked before the
/// work starts.
BakeReport bake_scene(const Scene& scene, const BakeConfig& config, const std::filesystem::path& output, bool force,
                      Diagnostics& diagnostics, Progress& progress);

/// Removes the LOD levels that were kept in config.resume; call it once the file is written. Failure to remove them is
/// a warning, not an error.
void forget_resumed_levels(const BakeConfig& config, BakeReport& report, Diagnostics& diagnostics);

} // namespace packtrace
