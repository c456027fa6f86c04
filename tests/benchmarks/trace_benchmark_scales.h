#pragma once

#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "runtime/camera/gbuffer.h"
#include "tests/benchmarks/trace_benchmark_inputs.h"

namespace packtrace {

/// Bakes a scene at several scales, sends the rays of one frame through it at each, and prints how many of each
/// system's hits are not those that it has at scale 1. Scales are rounded to powers of two.
/// Throws as load_trace_scene(), bake_trace_scene() and record_frame().
nlohmann::ordered_json measure_scales(const std::string& name, const TraceInputOptions& options,
                                      const std::string& camera, ImageSize size, std::span<const double> scales);

/// How much longer the rays of one frame take in the generated mesh of options.mesh_triangles than in one with a
/// sixteenth of them, the camera and the shape being the same: prints and returns the ratio of times a ray.
/// Throws as load_trace_scene(), bake_trace_scene() and record_frame().
nlohmann::ordered_json measure_growth(const TraceInputOptions& options, const std::string& camera, ImageSize size,
                                      uint32_t repeats, bool cpu_clock);

} // namespace packtrace
