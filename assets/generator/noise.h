#pragma once

#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace::scenegen {

/// Smooth value noise over the integer lattice, in [-1, 1]. Requires |coordinate| < 2^31.
double value_noise(DVec3 point, uint64_t seed);

/// Sum of octaves of value noise, each with twice the frequency and half the amplitude of the previous one; scaled to
/// [-1, 1].
double fractal_noise(DVec3 point, uint64_t seed, uint32_t octaves);

} // namespace packtrace::scenegen
