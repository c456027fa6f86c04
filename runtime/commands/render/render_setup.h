#pragma once

#include <memory>

#include "runtime/commands/render/render_camera.h"
#include "runtime/commands/render/render_options.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/stopwatch.h"

namespace packtrace {

/// Scene, camera, settings and frame loop of `render`, for stills and sequences.
struct RenderSetup {
  /// Loads the scene and prepares the frame loop.
  /// @param detail as in FrameConfig
  /// @param layers names of all layers that are written
  /// Throws like load_scene(), choose_camera(), make_config() and FrameLoop, and MemoryError for large pictures.
  RenderSetup(const RenderOptions& options, const GlobalOptions& globals, const DetailConfig& detail,
              const std::vector<std::string>& layers, Progress& progress, ProgressDisplay& display);
  RenderSetup(const RenderSetup&) = delete;
  RenderSetup& operator=(const RenderSetup&) = delete;

  Stopwatch loading;  ///< begins with the constructor
  LoadedScene loaded; ///< not movable: its source refers to it
  double load_s = 0.0;
  ChosenCamera camera;
  StillConfig config;
  SceneMotion motion;  ///< nothing moves if the scene is shown at rest
  double time_s = 0.0; ///< of a still, or of the first picture unless the path begins at another time
  MemoryReservation pixels;
  std::unique_ptr<FrameLoop> loop;

private:
  void prepare_motion(const RenderOptions& options, const GlobalOptions& globals);
};

} // namespace packtrace
