#pragma once

#include <span>
#include <string>

#include "compress/bake/bake_scene.h"
#include "compress/bake/geometry_packer.h"
#include "compress/bake/plan/geometry_plan.h"
#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Reports a warning to the diagnostics and adds it to the report.
void warn(std::string message, BakeReport& report, Diagnostics& diagnostics);

/// Fills in the report's totals over the scene, and warns of what was repaired or left out.
/// @param packed by geometry of the plan
void add_up(const Scene& scene, const ScenePlan& plan, std::span<const PackedGeometry> packed, BakeReport& report,
            Diagnostics& diagnostics);

/// Returns the file's summary without the step of the world's grid.
/// @param report with its totals
/// @param bounds world-space bounds of all instances at all times
/// @param bits sizes of all clusters' streams in bits
baked::SummaryRecord summary_of(const Scene& scene, const BakeConfig& config, const BakeReport& report,
                                const Bounds& bounds, const ClusterView::StreamBits& bits);

} // namespace packtrace
