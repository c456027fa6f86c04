#pragma once

#include <span>

#include <nlohmann/json.hpp>

#include "runtime/trace/ray_tracer.h"
#include "tests/benchmarks/trace_benchmark_rays.h"

namespace packtrace {

/// What a packed tracer does for a ray, by phase: nodes and leaves tested, and so on. Prints it as well. The same for
/// any load; batches decoded depend on what the thread traced before. Nothing of other tracers.
/// @param rays in the tracer's space
nlohmann::ordered_json count_work(std::span<const RecordedRays> rays, const RayTracer& tracer);

} // namespace packtrace
