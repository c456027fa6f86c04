#pragma once

#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace::scenegen {

/// Smooth value noise over the integer lattice, in [-1, 1]. |coordinates| < 2^31.
double value_noise(DVec3 point, uint64_t seed);

/// Sum of octaves of value noise, each of twice the frequency and half the amplitude; scaled into [-1, 1].
double fractal_noise(DVec3 point, uint64_t seed, uint32_t octaves);

} // namespace packtrace::scenegen
