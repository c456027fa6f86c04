#pragma once

#include <span>

#include <nlohmann/json.hpp>

#include "runtime/trace/ray_tracer.h"
#include "tests/benchmarks/trace_benchmark_rays.h"

namespace packtrace {

/// Counts the work of a packed tracer per ray and phase (nodes and leaves tested, and so on), and prints it. The counts
/// do not depend on the machine's load, except that decoded batches depend on what the thread traced before. Returns an
/// empty array for other tracers.
/// @param rays in the tracer's space
nlohmann::ordered_json count_work(std::span<const RecordedRays> rays, const RayTracer& tracer);

} // namespace packtrace
