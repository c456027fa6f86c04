#pragma once

#include "runtime/denoise/filter.h"

namespace packtrace {

/// Returns AO for a hit pixel that has neither history nor a sample, in this order of preference:
///  - the mean of its neighbours with history on the same surface, by guide weight, 1, 2 or 4 pixels away: of the
///    smallest distance at which there are any;
///  - the mean of all pixels with history within kPlaneBorder pixels;
///  - 1 (open).
float filled_value(const FilterInput& input, int x, int y);

} // namespace packtrace
