#pragma once

#include <cstdint>

#include "pbrt_import/base/progress.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/trace/view_tracer.h"

namespace packtrace {

/// Whether a ViewTracer makes the occlusion rays of a configuration and plan itself, with the results of spans of rays:
/// the default sampler, equally many samples per pixel, no interreflection, and hits that occlude fully or by a curve.
bool traces_view_occlusion(const AoConfig& config, const SamplePlan& plan);

/// trace_ao() for such tracers. Returns the number of rays.
/// @param radius of occlusion, world units
uint64_t trace_view_occlusion(const ViewTracer& tracer, const UnitSpace& space, const GBuffer& gbuffer,
                              const AoConfig& config, float radius, const SamplePlan& plan, AoFrame& ao,
                              Progress& progress);

} // namespace packtrace
