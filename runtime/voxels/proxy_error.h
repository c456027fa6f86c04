#pragma once

#include "runtime/ao/ao_config.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Mean absolute difference of ambient occlusion between rays that see proxies and rays that see triangles. It is
/// measured at up to 256 pixels that hit something, evenly spread over the picture, with the same 128 rays per pixel
/// for both tracers. Deterministic.
/// @param exact, proxies tracers of the source's instances
/// @param seen G-buffer of `exact`
/// @return 0 if no pixel hits anything
/// Throws as trace_ao().
double proxy_error(const SceneSource& source, const RayTracer& exact, const RayTracer& proxies, const GBuffer& seen,
                   const AoConfig& config);

} // namespace packtrace
