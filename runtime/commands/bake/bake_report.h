#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/bake/bake_scene.h"
#include "runtime/commands/bake/bake_options.h"

namespace packtrace {

/// Wall times in seconds.
struct BakeTimings {
  double import_s = 0.0, bake_s = 0.0;
};

/// The report of `bake --json` (docs/json_output.md).
/// @param by_geometry as in to_json()
nlohmann::json bake_json(const BakeOptions& options, const BakeReport& baked, const ImportStatistics& imported,
                         const BakeTimings& timings, bool by_geometry);

/// Human-readable sizes, errors and counts of what was baked.
std::string bake_text(const BakeReport& baked);

/// Warning about geometries whose grid step is coarser than required, with the option that avoids it; empty if there
/// are none.
/// @param chosen whether the user gave a precision option
std::string precision_warning(const BakeReport& baked, bool chosen);

} // namespace packtrace
