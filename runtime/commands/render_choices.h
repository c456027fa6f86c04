#pragma once

#include <string>

#include "pbrt_import/scene/scene.h"
#include "runtime/commands/loaded_scene.h"
#include "runtime/render/renderer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// The settings that a render chose, each with the reason as text, such as "--size" or "the camera's film".
struct RenderChoices {
  Camera camera;
  std::string camera_reason, size_reason, radius_reason, backend_reason, threads_reason;
};

/// Wall times in seconds that RenderTimings does not include.
struct FileTimings {
  double load_s = 0.0, write_s = 0.0;
};

/// The additional output of `render -v`: a line per choice, and lines for load time, write time and memory.
std::string choices_text(const RenderChoices& choices, const RenderConfig& config, const LoadedScene& loaded,
                         const RayTracer& tracer, const FileTimings& timings);

} // namespace packtrace
