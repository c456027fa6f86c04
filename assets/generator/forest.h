#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct ForestConfig {
  uint64_t seed = 11;
  uint64_t triangles = 10'000'000; ///< minimum number of placed triangles; [100000, 10^11]
  uint64_t instances = 0;          ///< if not 0: number of plants, instead of `triangles`; [100, 50000000]
};

/// Writes a forest of a few species, with a path: FOLDER/forest.pbrt. Memory does not grow with its size.
/// Throws Error(kUsage) if config is out of range, Error(kIo) if writing fails.
SceneTotals generate_forest(const ForestConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
