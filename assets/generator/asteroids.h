#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct AsteroidsConfig {
  uint64_t seed = 5;
  uint64_t geometries = 500;   ///< rocks of about 4,000 triangles each; [1, 5000]
  uint64_t instances = 58'000; ///< at least one of each; [geometries, 50000000]
};

/// A belt of rocks about the camera, at one density however many: FOLDER/asteroids.pbrt. Many geometries, each seen
/// from near and far. Memory does not grow with instances. Throws Error(kUsage) out of range, Error(kIo) on disk
/// trouble.
SceneTotals generate_asteroids(const AsteroidsConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
