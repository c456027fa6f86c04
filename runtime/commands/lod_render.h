#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "runtime/commands/loaded_scene.h"
#include "runtime/render/renderer.h"
#include "runtime/trace/source/lod_source.h"

namespace packtrace {

/// The options of `render` for choosing LOD levels.
struct LodOptions {
  std::optional<double> error_px; ///< maximum screen-space error in pixels; if not set, level 0 is used everywhere
  std::optional<std::string> scheme;
  std::optional<double> traced_ratio, culled_scale;
  std::optional<uint32_t> tolerance;
  std::optional<std::string> rays, cull;

  /// Whether only occlusion rays use coarser levels, and camera rays use level 0.
  bool only_occlusion() const { return rays == "occlusion"; }
};

/// Adds --lod-error and the other --lod options to a verb. `options` must outlive the verb.
void add_lod_options(CLI::App& verb, LodOptions& options);

/// Throws Error(kUsage) for values out of range, contradictory options, and options that need --lod-error.
void validate(const LodOptions& options);

/// The LOD cuts chosen for a view, and the geometry to trace.
struct ChosenDetail {
  std::unique_ptr<const std::vector<LodGeometry>> geometries; ///< on the heap, because `sharing` refers to it
  std::vector<LodInstance> instances;
  std::unique_ptr<LodSharing> sharing;
  LodPlan plan;
  std::unique_ptr<LodSource> source;
  double error_px = 0.0;
  size_t culled = 0; ///< number of instances that --lod-cull classifies as culled
  double load_s = 0.0, plan_s = 0.0, source_s = 0.0;
};

/// Throws Error(kUsage) for a .pbrt scene or a file without LOD levels.
/// @param input file name for messages
void require_levels(const std::string& input, const LoadedScene& loaded);

/// Chooses LOD cuts for a view.
/// @param loaded a file with LOD levels
/// @param seen G-buffer of the camera rays; null if they have not been traced. Required for --lod-cull visible.
/// Throws like LodSharing and PrimaryCamera.
ChosenDetail choose_detail(const LoadedScene& loaded, const Camera& camera, const RenderConfig& config,
                           const LodOptions& options, const GBuffer* seen);

/// The "lod" report of `render --json` (docs/json_output.md).
/// @param tracer built from detail.source
nlohmann::json detail_json(const ChosenDetail& detail, const RayTracer& tracer);

/// Human-readable form of detail_json().
std::string detail_text(const nlohmann::json& detail);

} // namespace packtrace
