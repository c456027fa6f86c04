#pragma once

#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/benchmarks/trace_benchmark_embree.h"
#include "tests/benchmarks/trace_benchmark_inputs.h"
#include "tests/benchmarks/trace_benchmark_rays.h"

namespace packtrace {

inline constexpr const char* kRayTracer = "RayTracer"; ///< `call` of rows that the renderer can use

/// One row of the tables: a system that traces the rays.
struct System {
  std::string name;
  std::string call;
  std::unique_ptr<RayTracer> tracer;
  double build_ms = 0.0;
  bool watertight = false;                                    ///< --max-mismatches applies to it
  std::shared_ptr<const std::vector<RecordedRays>> rays = {}; ///< in the tracer's space
  std::vector<RayResults> results = std::vector<RayResults>(3);
  std::vector<std::vector<double>> seconds = {}; ///< per phase: one time per repeat
};

/// All systems that trace one input. Rows share `trees`, so these are declared first and destroyed last.
struct Systems {
  std::vector<std::unique_ptr<EmbreeTracer>> trees;
  std::vector<System> rows;
  size_t single = 0, packets = 0; ///< the rows of default Embree that ratios refer to
  size_t truth = 0;               ///< the row that mismatches are counted against
  size_t truth_trees = 0;
};

/// Returns all systems for an input, without rays.
/// @param embree_device configuration of rtcNewDevice(), such as "max_isa=avx2", for Embree's trees
Systems make_systems(const TraceInput& input, const char* embree_device);

/// Judges with exact hits which systems are right, and prints a table. Needs the systems' rays and results.
nlohmann::ordered_json compare_with_exact_hits(const TraceInput& input, const Systems& systems);

} // namespace packtrace
