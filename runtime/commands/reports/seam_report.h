#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/bake/grid/seam_gaps.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/frame/detail.h"
#include "runtime/frame/rendered_image.h"

namespace packtrace {

/// Seams between instances on their own grids and the geometry that they touch, as JSON for `bake --json` and
/// `info --json` (docs/json_output.md).
nlohmann::json seams_json(const SeamSummary& seams);

/// Human-readable form of seams_json(); empty if there are no seams.
std::string seams_text(const SeamSummary& seams);

/// Bounds of the width of such seams in an image, as JSON for `render --json`. Each visible instance is evaluated at
/// its nearest visible point.
/// @param camera camera with the traced image size, including supersampling
/// @param detail LOD cuts that camera rays used; null: level 0
nlohmann::json visible_seams_json(const InstanceSeams& seams, const RenderedImage& image, const PrimaryCamera& camera,
                                  const DetailPlanner* detail);

/// Human-readable form of visible_seams_json(); empty if no seam can be wider than half a pixel.
std::string visible_seams_text(const nlohmann::json& seams);

} // namespace packtrace
