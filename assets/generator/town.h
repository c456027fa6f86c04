#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct TownConfig {
  uint64_t seed = 7;
  uint32_t instances = 6000; ///< approximate; plants on the hillside make up the number; [3000, 20000000]
};

/// Writes a harbour town on a terraced hillside: FOLDER/town.pbrt. Throws Error(kUsage) if config is out of range,
/// Error(kIo) if writing fails.
SceneTotals generate_town(const TownConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
