#pragma once

#include "pbrt_import/scene/camera_rays.h"
#include "pbrt_import/base/progress.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Motion of points that the previous camera cannot see at all, per axis: it leads outside any image.
inline constexpr float kNoMotionPx = 1e9f;

/// Traces one ray per pixel of now's image and fills every field of the G-buffer, resizing it where needed.
/// Positions are computed in double from the hit triangle's decoded vertices, so they lie on its plane to half an ulp
/// per axis. Where a surface has no vertex normals the shading normal is the geometric one.
/// Motion is this pixel's centre minus the point's place in previous's image; it is exactly zero for equal cameras.
/// offset is described in ray_offset.h. The result is the same for any number of threads.
/// Throws Error(kCancelled).
void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PrimaryCamera& previous, GBuffer& gbuffer, Progress& progress);

} // namespace packtrace
