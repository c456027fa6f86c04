#pragma once

#include <cstdint>

#include "runtime/denoise/kernels/lanes.h"
#include "runtime/denoise/kernels/units.h"

/// What the kernels of all passes use. Local to each file, because every instruction set compiles them.
namespace packtrace {
namespace {

constexpr float kSquaredNormalUnit = kNormalUnit * kNormalUnit;

/// Replacements for std::min and std::max, which take references and thereby keep GCC from vectorising loops.
inline float lesser(float a, float b) { return b < a ? b : a; }
inline float greater(float a, float b) { return a < b ? b : a; }

/// Convert moments from and to units of 1 / kMomentUnits. NaN becomes 0.
inline float moment_of(uint16_t units) { return static_cast<float>(static_cast<int>(units)) * (1.0f / kMomentUnits); }
inline F32 moments_of(I32 units) { return as_floats(units) * (1.0f / kMomentUnits); }
inline I32 in_moment_units(F32 moment) {
  return truncated(lesser(greater(all(0.0f), moment), all(1.0f)) * kMomentUnits + 0.5f);
}

} // namespace
} // namespace packtrace
