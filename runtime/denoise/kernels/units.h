#pragma once

namespace packtrace {

/// Motion up to this many pixels per frame is ignored. Over the longest default history (256 frames) it adds up to a
/// quarter of a pixel.
inline constexpr float kStillMotion = 1e-3f;

/// Histories store moments, which are between 0 and 1, in units of 1 / kMomentUnits.
inline constexpr float kMomentUnits = 65535.0f;

/// Guides store components of normals in these units.
inline constexpr float kNormalUnit = 1.0f / 16384.0f;

/// Depths of surfaces lie in [kNearestDepth, kFarthestDepth]: they and their reciprocals are normal floats, which GPUs
/// do not flush to zero.
inline constexpr float kNearestDepth = 0x1p-126f, kFarthestDepth = 0x1p126f;

} // namespace packtrace
