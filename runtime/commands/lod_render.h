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

/// How `render` chooses detail.
struct LodOptions {
  std::optional<double> error_px; ///< none: level 0 everywhere
  std::optional<std::string> scheme;
  std::optional<double> traced_ratio, culled_scale;
  std::optional<uint32_t> tolerance;
  std::optional<std::string> rays, cull;

  /// Whether camera rays meet level 0.
  bool only_occlusion() const { return rays == "occlusion"; }
};

/// Adds --lod-error and what goes with it to a verb; options must outlive it.
void add_lod_options(CLI::App& verb, LodOptions& options);

/// Throws Error(kUsage) for values out of range, unknown schemes, and options that only count with --lod-error.
void validate(const LodOptions& options);

/// What a view shows of a file's levels of detail.
struct ChosenDetail {
  std::unique_ptr<const std::vector<LodGeometry>> geometries; ///< at a place that stays
  std::vector<LodInstance> instances;
  std::unique_ptr<LodSharing> sharing;
  LodPlan plan, alone; ///< alone: a cut for each instance, which plans are measured against
  std::unique_ptr<LodSource> source;
  double error_px = 0.0;
  size_t culled = 0; ///< instances that the camera does not see directly
  double load_s = 0.0, plan_s = 0.0, source_s = 0.0;
};

/// Throws Error(kUsage) for a .pbrt scene or a file without levels of detail.
/// @param input names the file in errors
void require_levels(const std::string& input, const LoadedScene& loaded);

/// Throws like LodSharing and PrimaryCamera. @param loaded has levels
/// @param seen what camera rays met; null before they are traced
ChosenDetail choose_detail(const LoadedScene& loaded, const Camera& camera, const RenderConfig& config,
                           const LodOptions& options, const GBuffer* seen);

/// As `render --json` writes it (docs/json_output.md).
nlohmann::json detail_json(const ChosenDetail& detail, const RayTracer& tracer);

/// The same for people, from the JSON.
std::string detail_text(const nlohmann::json& detail);

} // namespace packtrace
