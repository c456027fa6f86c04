#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct TownConfig {
  uint64_t seed = 7;
  uint32_t instances = 6000; ///< about how many: plants on the hillside fill up what the town leaves; [3000, 20000000]
};

/// A harbour town on a terraced hillside: FOLDER/town.pbrt. Throws Error(kUsage) out of range, Error(kIo) on disk
/// trouble.
SceneTotals generate_town(const TownConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
