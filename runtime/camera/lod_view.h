#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/lod/lod_sharing.h"

namespace packtrace {

/// From where a camera judges detail. Pixels are those of camera.size(). There is no near plane: nothing is nearer than
/// 1e-6 of the scene's diagonal. For orthographic cameras the distance does not count, so that everything is as near as
/// something far outside the scene, and errors are allowed in proportion.
/// @param error_px as in make_detail_view() @param world the scene's box
/// Throws Error(kUsage) for an error out of range.
DetailView detail_view(const PrimaryCamera& camera, const Bounds& world, double error_px);

/// How wide a pixel is at a place, in the middle of the image; world units, as detail_view() has it.
double pixel_width(const PrimaryCamera& camera, DVec3 place_world);

/// How many pixels an error at a place is wide, in the middle of the image; as detail_view() has it.
double error_in_pixels(const PrimaryCamera& camera, DVec3 place_world, double error_world);

/// A byte an instance: 1 where the ball around it lies outside of what the camera sees, so that none of its rays meets
/// it. Environment cameras see everything.
std::vector<uint8_t> outside_view(const PrimaryCamera& camera, std::span<const LodGeometry> geometries,
                                  std::span<const LodInstance> instances);

/// A byte an instance: 1 where no pixel shows it.
/// @param count of instances
std::vector<uint8_t> not_in_image(const GBuffer& gbuffer, size_t count);

} // namespace packtrace
