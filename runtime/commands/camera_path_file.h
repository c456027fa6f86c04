#pragma once

#include <filesystem>

#include "runtime/frame/camera_path.h"

namespace packtrace {

/// Reads a camera path (docs/frames.md).
/// @param base projection, film, and the defaults of up and fov
/// @param origin world coordinates of the scene's zero (Scene::origin), which are subtracted from the file's positions
/// Throws Error(kInput) with the file's name: a file that cannot be read or is larger than 64 MiB, text that is not
/// JSON (with line and column), unknown or missing fields, and whatever CameraPath rejects.
CameraPath read_camera_path(const std::filesystem::path& file, const Camera& base, DVec3 origin);

} // namespace packtrace
