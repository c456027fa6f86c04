#pragma once

#include <string>

#include "pbrt_import/scene/scene.h"
#include "runtime/commands/loaded_scene.h"
#include "runtime/render/renderer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// What a render chose, each with the reason in words: "the first of the file's 2".
struct RenderChoices {
  Camera camera;
  std::string camera_reason, size_reason, radius_reason, backend_reason, threads_reason;
};

/// Seconds that RenderTimings does not have.
struct FileTimings {
  double load_s = 0.0, write_s = 0.0;
};

/// What `render -v` adds, a line for each choice and for the time and memory outside of tracing.
std::string choices_text(const RenderChoices& choices, const RenderConfig& config, const LoadedScene& loaded,
                         const RayTracer& tracer, const FileTimings& timings);

} // namespace packtrace
