#pragma once

#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "runtime/commands/render_camera.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Wall times in seconds that RenderTimings does not include.
struct FileTimings {
  double load_s = 0.0, write_s = 0.0;
};

/// The report of `render --json` (docs/json_output.md), without the seams between instances.
/// @param source what was traced last
/// @param tracers the camera's; with --lod-rays occlusion also the occlusion rays'
/// @param detail the LOD cuts, with --lod-error
/// @param files the files written
nlohmann::json render_json(const RenderOptions& options, const RenderConfig& config, const RenderedImage& image,
                           const SceneSource& source, std::span<const RayTracer* const> tracers,
                           const ChosenCamera& camera, const std::optional<ChosenDetail>& detail,
                           const std::vector<std::string>& files, const FileTimings& timings);

/// Prints the human-readable form of render_json().
void print_render(std::FILE* stream, const nlohmann::json& report);

/// The additional output of `render -v`: the settings chosen, each with its reason, and lines for load time, write time
/// and memory.
std::string choices_text(const RenderOptions& options, const GlobalOptions& globals, const ChosenCamera& camera,
                         const RenderConfig& config, const LoadedScene& loaded, const RayTracer& tracer,
                         const FileTimings& timings);

} // namespace packtrace
