#pragma once

#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "runtime/camera/gbuffer.h"
#include "tests/benchmarks/trace_benchmark_inputs.h"

namespace packtrace {

/// Bakes a scene at several scales, traces the rays of one frame at each scale, and prints how many of each system's
/// hits differ from its hits at scale 1. Scales are rounded to powers of two.
/// Throws like load_trace_scene(), bake_trace_scene() and record_frame().
nlohmann::ordered_json measure_scales(const std::string& name, const TraceInputOptions& options,
                                      const std::string& camera, ImageSize size, std::span<const double> scales);

/// Compares the generated mesh of options.mesh_triangles with one of a sixteenth of them, with the same camera and
/// shape. Prints and returns the ratios of time per ray.
/// Throws like load_trace_scene(), bake_trace_scene() and record_frame().
nlohmann::ordered_json measure_growth(const TraceInputOptions& options, const std::string& camera, ImageSize size,
                                      uint32_t repeats, bool cpu_clock);

} // namespace packtrace
