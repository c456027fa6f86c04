#pragma once

#include "runtime/denoise/kernels/units.h"

/// What the kernels of all passes use. Local to each file, because every instruction set compiles them.
namespace packtrace {
namespace {

constexpr float kSquaredNormalUnit = kNormalUnit * kNormalUnit;

/// Replacements for std::min and std::max, which take references and thereby keep GCC from vectorising loops.
inline float lesser(float a, float b) { return b < a ? b : a; }
inline float greater(float a, float b) { return a < b ? b : a; }

} // namespace
} // namespace packtrace
