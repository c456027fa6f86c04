#pragma once

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Adapts the offsets of a G-buffer rendered at one level of detail to occlusion rays that are traced against a coarser
/// scene: where the coarse surface lies above a point, the point's offset is increased so that its rays start above
/// that surface. To find such points, a ray is traced along the geometric normal, up to half the allowed error. If its
/// first hit is on the same instance, from below with respect to the side that the camera sees, the point lies beneath
/// the coarse surface. Any other hit, on a surface that faces the point or on another instance, is an occluder and
/// leaves the offset as it is.
/// @param coarse tracer that occlusion rays will use; it must have the same instances
/// @param error_px allowed distance of coarse surfaces from those of the G-buffer, in pixels of the camera
/// @param camera the camera of the G-buffer
void lift_origins(const RayTracer& coarse, const PrimaryCamera& camera, double error_px, GBuffer& gbuffer,
                  Progress& progress);

} // namespace packtrace
