#pragma once

/// What the kernels of all passes use. Local to each file, because every instruction set compiles them.
namespace packtrace {
namespace {

constexpr float kSquaredNormalUnit = 1.0f / (16384.0f * 16384.0f); // of kNormalUnit

/// Replacements for std::min and std::max, which take references and thereby keep GCC from vectorising loops.
inline float lesser(float a, float b) { return b < a ? b : a; }
inline float greater(float a, float b) { return a < b ? b : a; }

} // namespace
} // namespace packtrace
