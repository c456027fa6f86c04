#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct ForestConfig {
  uint64_t seed = 11;
  uint64_t triangles = 10'000'000; ///< placed, at least; [100000, 10^11]
  uint64_t instances = 0;          ///< if not 0: this many plants instead; [100, 50000000]
};

/// A clearing-lined forest of a few species, placed as often as asked: FOLDER/forest.pbrt. Memory does not grow with
/// it. Throws Error(kUsage) out of range, Error(kIo) on disk trouble.
SceneTotals generate_forest(const ForestConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
