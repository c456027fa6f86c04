#pragma once

#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Unit normals in 32 bits: bit 31 the sign of z, bits 16..30 x, bits 0..15 y;
/// x = 2 X / 32766 - 1, y = 2 Y / 65534 - 1, |z| = sqrt(1 - x^2 - y^2).
inline constexpr uint32_t kNormalXBits = 15;
inline constexpr uint32_t kNormalYBits = 16;

/// Largest angle between a unit normal and its decoded code, in degrees; reached near z = 0, where the reconstructed
/// component is the square root of the two stored ones' rounding error. The mean is .003.
inline constexpr double kZsign32MaxErrorDegrees = 0.33;

/// The best of the nine codes around the rounded one. Inputs of any non-zero length are normalised first.
/// n must be finite and not zero.
uint32_t encode_zsign32(DVec3 n);

/// Unit length for every one of the 2^32 codes, also for those outside the unit disc.
Vec3 decode_zsign32(uint32_t code);

} // namespace packtrace
