#pragma once

#include <nlohmann/json.hpp>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/gpu/gpu_config.h"
#include "runtime/trace/gpu/structure_cache.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

nlohmann::json structure_stats_json(const StructureStats& stats);

/// Renders frames of a camera that orbits a scene with levels of detail, and reports what the driver's acceleration
/// structures take and save; null for files without levels.
/// @param device with GpuStructures::kDriver
nlohmann::json measure_structures(const BakedFile& file, const PackedSource& source, const Camera& camera,
                                  ImageSize size, const GpuConfig& device);

} // namespace packtrace
