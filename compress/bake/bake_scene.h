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

/// A geometry whose pictures may differ from the source's by more than the default precision promises
/// (PrecisionKind::kPicture). Steps are in units of the geometry's space.
struct BrokenPromise {
  std::string name;    ///< of the geometry
  std::string bound;   ///< what is not kept: height, pixel, contact or outline (PictureBound)
  double wanted = 0.0; ///< the step that would keep it
  double step = 0.0;
  double scale = 1.0;       ///< of its largest instance: wanted x scale is a step in world units
  bool float_limit = false; ///< the step is as fine as floats are where the geometry lies
};

/// What a bake did. `file` is what summarize() says of the written file.
struct BakeReport {
  FileSummary file;
  uint64_t source_triangles = 0;     ///< of the scene, unused objects included
  uint64_t source_vertices = 0;      ///< of what is stored
  uint64_t merged_vertices = 0;      ///< equal after quantisation to another one of their geometry
  uint64_t collapsed_triangles = 0;  ///< left out, as they have no area on their grid
  uint64_t coinciding_triangles = 0; ///< left out, as quantisation made them equal to another one
  uint64_t vanished_geometries = 0;  ///< of which no triangle is left
  double source_area = 0.0;      ///< of all placed triangles, world units squared; where an instance stretches, about
  double collapsed_area = 0.0;   ///< of collapsed_triangles, in the source, likewise
  uint64_t shared_shapes = 0;    ///< shapes outside objects that use another's geometry
  uint64_t instanced_shapes = 0; ///< shapes outside objects that lie on a grid of their own as they share a geometry
  SeamSummary seams;             ///< of instances on grids of their own
  uint64_t shared_objects = 0;   ///< objects that use another's geometry
  uint64_t unused_objects = 0;   ///< never instanced; not stored
  uint64_t unused_triangles = 0;
  uint64_t left_out = 0;   ///< shapes and instances that leave the float range; each is in the diagnostics
  double world_step = 0.0; ///< 0: no world-space geometry
  double world_median_edge = 0.0;
  uint64_t nested_geometries = 0;     ///< in world space on a finer grid than the scene's, as they are so small
  uint64_t finer_geometries = 0;      ///< with finer steps than the median edge asks for, as pictures need them
  std::vector<BrokenPromise> promise; ///< what the default precision would keep; empty: pictures are as promised
  double max_position_error = 0.0;    ///< measured against the source, largest axis, object units
  double max_normal_error_degrees = 0.0, mean_normal_error_degrees = 0.0;
  double max_uv_error = 0.0;
  double max_uv_error_texels = 0.0;  ///< of the finest texture that the same geometry looks up
  uint64_t lod_geometries = 0;       ///< with levels of detail
  uint64_t resumed_geometries = 0;   ///< whose levels an interrupted bake had left
  std::vector<std::string> warnings; ///< also in the diagnostics
};

struct BakedScene {
  std::vector<std::byte> bytes; ///< the file
  BakeReport report;
};

/// Packs a scene. The bytes depend on scene and config only, not on thread count or time.
/// Shapes and instances that leave the range of floats where they are placed are left out and reported as errors in the
/// diagnostics; their instance numbers stay, of an empty geometry.
/// Throws MemoryError where packing may need more than config.memory; Error(kUsage) for a config out of range, Error(kInput) for scenes that break the rules of scene.h, or where
/// something would be left out and config is strict,
/// Error(kLimitExceeded) where a limit of the format or the promised accuracy cannot be met, Error(kCancelled),
/// Error(kIo) where config.resume cannot be used.
BakedScene bake_to_bytes(const Scene& scene, const BakeConfig& config, Diagnostics& diagnostics, Progress& progress);

/// bake_to_bytes() into a file, which appears complete or not at all.
/// Throws also Error(kIo): the output exists and force is not set, or cannot be written (asked before the work starts).
BakeReport bake_scene(const Scene& scene, const BakeConfig& config, const std::filesystem::path& output, bool force,
                      Diagnostics& diagnostics, Progress& progress);

/// Removes what an interrupted bake left in config.resume for the next one: the file is written. What cannot be removed
/// is therefore no error but a warning.
void forget_resumed_levels(const BakeConfig& config, BakeReport& report, Diagnostics& diagnostics);

} // namespace packtrace
