#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/frame/detail.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// The options of `render` for choosing LOD levels.
struct LodOptions {
  std::optional<double> error_px; ///< DetailConfig::error_px
  std::optional<std::string> scheme;
  std::optional<double> traced_ratio, culled_scale;
  std::optional<uint32_t> tolerance;
  std::optional<std::string> rays, cull;
};

/// Adds --lod-error and the other --lod options to a verb. `options` must outlive the verb.
void add_lod_options(CLI::App& verb, LodOptions& options);

/// Throws Error(kUsage) for values out of range, contradictory options, and options that need --lod-error.
/// @param measure also compares the plan with separate cuts for all instances, for reports
DetailConfig detail_config(const LodOptions& options, bool measure);

/// Throws Error(kUsage) for a .pbrt scene or a file without LOD levels.
/// @param input file name for messages
void require_levels(const std::string& input, const LoadedScene& loaded);

/// The "lod" report of `render --json` (docs/json_output.md).
/// @param tracer built from detail.source()
nlohmann::json detail_json(const DetailPlanner& detail, const RayTracer& tracer);

/// Human-readable form of detail_json().
std::string detail_text(const nlohmann::json& detail);

} // namespace packtrace
