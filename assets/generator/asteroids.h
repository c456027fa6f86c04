#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct AsteroidsConfig {
  uint64_t seed = 5;
  uint64_t geometries = 500;   ///< distinct rocks of about 4,000 triangles each; [1, 5000]
  uint64_t instances = 58'000; ///< at least one per geometry; [geometries, 50000000]
};

/// Writes a belt of rocks around the camera: FOLDER/asteroids.pbrt. The density of rocks does not depend on their
/// number. There are many geometries, each seen from near and far. Memory does not grow with the number of instances.
/// Throws Error(kUsage) if config is out of range, Error(kIo) if writing fails.
SceneTotals generate_asteroids(const AsteroidsConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
