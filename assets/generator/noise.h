#pragma once

#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace::scenegen {

/// Smooth value noise over the integer lattice, in [-1, 1]. Requires |coordinate| < 2^31.
double value_noise(DVec3 point, uint64_t seed);

/// Sum of octaves of value noise, each with twice the frequency and half the amplitude of the previous one; scaled to
/// [-1, 1].
double fractal_noise(DVec3 point, uint64_t seed, uint32_t octaves);

/// Smooth value noise over the integer lattice of a plane, in [-1, 1], that repeats after `period` cells on both axes.
/// Requires |coordinate| < 2^31 and period > 0.
double tiling_noise(glm::dvec2 point, int64_t period, uint64_t seed);

} // namespace packtrace::scenegen
