#pragma once

#include "runtime/ao/ao_config.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// How much ambient occlusion changes if its rays see proxies: the mean absolute difference at up to 256 pixels that
/// hit something, spread evenly over the picture, from 128 rays each, the same for both tracers. The result depends on
/// scene, view and parameters only.
/// @param exact, proxies tracers of the source's instances
/// @param seen G-buffer of `exact`
/// @return 0 if no pixel hits anything
/// Throws as trace_ao().
double proxy_error(const SceneSource& source, const RayTracer& exact, const RayTracer& proxies, const GBuffer& seen,
                   const AoConfig& config);

} // namespace packtrace
