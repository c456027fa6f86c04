#pragma once

#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "runtime/commands/render/render_camera.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Wall times in seconds that PassTimes does not include.
struct FileTimings {
  double load_s = 0.0, write_s = 0.0;
};

/// Mean of the pixels that have a value, 0 if none has.
double mean_of_valid(const std::vector<float>& ao);

/// The report of `render --json` (docs/json_output.md), without the seams between instances.
/// @param loop after its last frame
/// @param files the files written
nlohmann::json render_json(const RenderOptions& options, const StillConfig& config, const RenderedImage& image,
                           const PictureReport& report, const FrameLoop& loop, const ChosenCamera& camera,
                           const std::vector<std::string>& files, const FileTimings& timings);

/// Prints the human-readable form of render_json().
void print_render(std::FILE* stream, const nlohmann::json& report);

/// The additional output of `render -v`: the settings chosen, each with its reason, and lines for load time, write time
/// and memory.
std::string choices_text(const RenderOptions& options, const GlobalOptions& globals, const ChosenCamera& camera,
                         const StillConfig& config, const LoadedScene& loaded, const RayTracer& tracer,
                         const FileTimings& timings);

} // namespace packtrace
