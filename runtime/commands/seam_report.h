#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/bake/grid/seam_gaps.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/commands/lod_render.h"
#include "runtime/render/renderer.h"

namespace packtrace {

/// Seams between instances on grids of their own and what they touch, as `bake --json` and `info --json` write them
/// (docs/json_output.md).
nlohmann::json seams_json(const SeamSummary& seams);

/// The same for people; empty where there are none.
std::string seams_text(const SeamSummary& seams);

/// How wide such seams may be in a picture, as `render --json` writes it: of the instances that pixels show, each where
/// it is nearest.
/// @param camera of the pixels traced
/// @param detail what was traced by camera rays; null: level 0
nlohmann::json visible_seams_json(const InstanceSeams& seams, const RenderedImage& image, const PrimaryCamera& camera,
                                  const ChosenDetail* detail);

/// The same for people; empty where no seam is wider than half a pixel.
std::string visible_seams_text(const nlohmann::json& seams);

} // namespace packtrace
