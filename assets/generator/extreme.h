#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct ExtremeConfig {
  uint64_t seed = 5;
};

/// Writes a scene with scales that floats can barely represent side by side: FOLDER/extreme.pbrt. One boulder mesh
/// appears as a crumb of size 1e-6 and as a mountain of 1e6; a group of objects is 1e7 away; slabs have no thickness
/// and needles almost none. Throws Error(kIo) if writing fails.
SceneTotals generate_extreme(const ExtremeConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
