#pragma once

#include <filesystem>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/frame/camera_path.h"

namespace packtrace {

/// Reads a camera path (docs/frames.md).
/// @param base projection, film, and the defaults of up and fov
/// @param origin world coordinates of the scene's zero (Scene::origin), which are subtracted from the file's positions
/// Throws Error(kInput), "file:line:column: problem", for what is not JSON of that form: unknown or missing fields,
/// fewer than two keys, and whatever CameraPath rejects. Throws MemoryError.
CameraPath read_camera_path(const std::filesystem::path& file, const Camera& base, DVec3 origin,
                            const MemoryBudget& budget);

} // namespace packtrace
