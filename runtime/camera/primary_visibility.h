#pragma once

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Motion per axis of points that the previous camera cannot project: it leads outside any image.
inline constexpr float kNoMotionPx = 1e9f;

/// Traces one ray per pixel of now's image and fills every field of the G-buffer, which is resized if needed. Positions
/// are computed in double from the decoded vertices of the triangle that is hit, so they lie on its plane to within
/// half an ulp per axis. A surface without vertex normals gets the geometric normal as its shading normal. Motion is
/// the pixel's centre minus the point's projection into previous's image; it is exactly zero for equal cameras.
/// ray_offset.h describes offset. The result is the same for any number of threads.
/// Throws Error(kCancelled).
void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PrimaryCamera& previous, GBuffer& gbuffer, Progress& progress);

} // namespace packtrace
