#pragma once

#include "pbrt_import/scene/camera_rays.h"
#include "pbrt_import/base/progress.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Lets occlusion rays of points that the camera sees at one detail start in a scene of coarser detail: adds to the
/// G-buffer's offsets where the coarse surface lies above the point. A ray goes up the geometric normal, as far as half
/// the error that is allowed there; where what it meets first is the same instance from below, of the side that the
/// camera sees, the point lies within and rays start above. What faces the point, or is of another instance, occludes
/// it, and the point stays where it is.
/// @param coarse what occlusion rays will be traced by, of the same instances
/// @param error_px that coarse surfaces may lie beside those of the G-buffer; pixels of the camera
/// @param gbuffer of the camera
void lift_origins(const RayTracer& coarse, const PrimaryCamera& camera, double error_px, GBuffer& gbuffer,
                  Progress& progress);

} // namespace packtrace
