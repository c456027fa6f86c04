#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/scene/math.h"

namespace packtrace {

// Flags of a packed track.
inline constexpr uint32_t kTrackCatmullRom = 1u << 0;
inline constexpr uint32_t kTrackLoops = 1u << 1;
inline constexpr uint32_t kTrackUniformTimes = 1u << 2;
inline constexpr uint32_t kTrackRotationShift = 3; ///< RotationForm, 2 bits
inline constexpr uint32_t kTrackScaleShift = 5;    ///< ScaleForm, 3 bits

// Flags of a packed instance.
inline constexpr uint32_t kMotionRelative = 1u << 0;
inline constexpr uint32_t kMotionChained = 1u << 1;

enum class RotationForm : uint32_t { kNone, kConstant, kKeyed, kCount };
enum class ScaleForm : uint32_t { kNone, kUniform, kDiagonal, kSymmetric, kFull, kCount };

inline constexpr uint32_t kMaxChannelBits = 52;
inline constexpr int kMinChannelExponent = -1000, kMaxChannelExponent = 120;
/// Largest magnitude of a translation or scale, so that products of two maps are finite.
inline constexpr double kMaxChannelValue = 0x1p120;

/// Entries (column, row) of the scale matrix that each form stores, in order.
struct ScaleEntries {
  uint32_t count;
  std::array<std::array<uint8_t, 2>, 9> at;
};
inline constexpr std::array<ScaleEntries, 5> kScaleEntries{{
    {0, {}},
    {1, {{{0, 0}}}},
    {3, {{{0, 0}, {1, 1}, {2, 2}}}},
    {6, {{{0, 0}, {1, 1}, {2, 2}, {1, 0}, {2, 0}, {2, 1}}}},
    {9, {{{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2}, {2, 0}, {2, 1}, {2, 2}}}},
}};

/// The field of 0 in a keyed rotation; fields reach from 0 to twice that. The three smaller components c of a
/// quaternion are stored as round((c sqrt(2) + 1) middle), so that 0 is exact.
constexpr uint64_t rotation_middle(uint32_t bits) { return (uint64_t{1} << (bits - 1)) - 1; }

inline double rotation_component(uint64_t field, uint32_t bits) {
  return (static_cast<double>(field) / static_cast<double>(rotation_middle(bits)) - 1.0) * 0.70710678118654752440;
}

} // namespace packtrace
