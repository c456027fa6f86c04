#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/lod/lod_sharing.h"

namespace packtrace {

/// Returns the view for which screen-space errors are measured. Pixels are those of camera.size(). There is no near
/// plane: distances are clamped to at least 1e-6 of the scene's diagonal. For orthographic cameras the error must not
/// depend on the distance, so all points use the distance of a point far outside the scene, and the allowed error is
/// scaled accordingly.
/// @param error_px as in make_detail_view()
/// @param world the scene's bounds
/// Throws Error(kUsage) for an error out of range.
DetailView detail_view(const PrimaryCamera& camera, const Bounds& world, double error_px);

/// Width of a pixel at a point, as seen in the middle of the image; world units, as in detail_view().
double pixel_width(const PrimaryCamera& camera, DVec3 place_world);

/// Width in pixels of an error at a point, as seen in the middle of the image; as in detail_view().
double error_in_pixels(const PrimaryCamera& camera, DVec3 place_world, double error_world);

/// Returns one byte per instance: 1 if its bounding sphere lies outside the view frustum, so that no camera ray hits
/// it. Environment cameras see everything.
std::vector<uint8_t> outside_view(const PrimaryCamera& camera, std::span<const LodGeometry> geometries,
                                  std::span<const LodInstance> instances);

/// Returns one byte per instance: 1 if no pixel shows it.
/// @param count number of instances
std::vector<uint8_t> not_in_image(const GBuffer& gbuffer, size_t count);

} // namespace packtrace
