#pragma once

namespace packtrace {

/// Motion up to this many pixels per frame is ignored. Over the longest default history (256 frames) it adds up to a
/// quarter of a pixel.
inline constexpr float kStillMotion = 1e-3f;

/// Guides store components of normals in these units.
inline constexpr float kNormalUnit = 1.0f / 16384.0f;

} // namespace packtrace
