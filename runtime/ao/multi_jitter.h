#pragma once

#include <array>

#include "pbrt_import/scene/math.h"
#include "runtime/ao/sampler.h"

namespace packtrace {

using MultiJitterSet = std::array<Vec2, kSetPoints>;

/// The multi-jittered sets. Each has one point in every cell of an 8 x 8 grid, and one in every 64th of each axis.
/// Point i lies in cell (i % 8, i / 8). The same in every process.
/// Source: Chiu, Shirley, Wang, "Multi-jittered sampling", Graphics Gems IV (1994).
const std::array<MultiJitterSet, kSetCount>& multi_jitter_sets();

} // namespace packtrace
