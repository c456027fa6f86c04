#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct ExtremeConfig {
  uint64_t seed = 5;
};

/// Scales side by side that floats can barely hold: FOLDER/extreme.pbrt. One boulder mesh stands as a crumb of 1e-6 and
/// as a mountain of 1e6; a cluster lies 1e7 away; slabs have no thickness, needles almost none. Throws Error(kIo) on
/// disk trouble.
SceneTotals generate_extreme(const ExtremeConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
