#pragma once

#include <string>

#include "runtime/commands/render/render_options.h"
#include "runtime/view/view_camera.h"
#include "runtime/view/view_file.h"

namespace packtrace {

/// Loads a file to be viewed with the options of `render`; options.input is not read.
/// Throws like load_scene(), tracer_config() and require_levels().
ViewFile load_view_file(const std::string& name, const RenderOptions& options, const GlobalOptions& globals,
                        const DetailConfig& detail, Progress& progress, ProgressDisplay& display);

/// The camera of a view's start, as choose_camera() chooses it, on the base that `render --camera lookat:...` uses.
ViewCamera start_camera(const ViewFile& file, const RenderOptions& options, const GlobalOptions& globals);

} // namespace packtrace
