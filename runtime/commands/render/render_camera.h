#pragma once

#include <optional>
#include <string>

#include "pbrt_import/scene/camera_rays.h"
#include "runtime/commands/render/render_options.h"

namespace packtrace {

/// Reads a picture's size, "WIDTHxHEIGHT". Throws Error(kUsage).
ImageSize parse_size(const std::string& text);

/// The camera of a render.
struct ChosenCamera {
  Camera camera;
  std::optional<uint32_t> index; ///< index in the scene's cameras; not set if the camera frames the whole scene
  std::string reason;            ///< why the scene is framed although --camera auto was not given; else empty
};

/// Returns the camera given by the options; without --camera, camera 0, or a camera that frames the scene if it has
/// none. Throws Error(kUsage) if there is no such camera.
ChosenCamera choose_camera(const SceneSource& source, const RenderOptions& options, const GlobalOptions& globals);

/// Returns a camera that frames the whole scene, to replace a camera that sees nothing of it. Prints a warning.
ChosenCamera frame_whole_scene(const ChosenCamera& blind, const SceneSource& source, ImageSize size,
                               const RenderOptions& options, const GlobalOptions& globals);

} // namespace packtrace
