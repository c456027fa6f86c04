#pragma once

namespace packtrace {

/// Change of depth or disparity per pixel along x and y, for one row. Of the backward and the forward difference the
/// one of smaller magnitude is used, so that a step at a silhouette does not tilt the surface's tangent plane.
/// Neighbours that missed, with 0, are ignored; the derivative is 0 where the pixel or both neighbours missed.
/// @param here readable one pixel outside the row
void derive_row(int width, const float* above, const float* here, const float* below, float* dx, float* dy);

} // namespace packtrace
