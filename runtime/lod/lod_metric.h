#pragma once

#include <algorithm>
#include <cmath>

#include "pbrt_import/scene/math.h"
#include "runtime/lod/lod_geometry.h"

namespace packtrace {

/// From where detail is judged. World space.
struct DetailView {
  DVec3 eye{0.0};
  double near = 0.0;               ///< nothing is nearer than this; above 0
  double error_per_distance = 0.0; ///< error that may be seen, as the tangent of its angle
};

/// The one place where pixels become a tangent. `error_px` is a radius: how far in pixels a surface may lie to either
/// side of where level 0 is, in the middle of the image (pixels towards its edges see a little more).
///   error_per_distance = error_px tan(fov_y / 2) / (height_px / 2)
/// @param fov_y_rad full vertical field of view, in (0, pi)
/// Throws Error(kUsage) if a value is out of range or not finite.
DetailView make_detail_view(DVec3 eye_world, double near_world, double fov_y_rad, double height_px, double error_px);

/// No vector becomes longer than this many times its length: the largest singular value, rounded up by 1e-7 of it
/// (which is how well it is known where the two largest are equal); at least 1e-300.
/// Throws Error(kInput) if the transform is not finite or beyond 1e100.
double largest_stretch(const DAffine& world_from_object);

/// What one instance adds to a view.
///
/// A group of error E about (c, r) passes (what was made from it will do) where
///   E s <= T d,   d = max(near, |M c - eye| - s r - slack (level + 1))
/// with s the largest stretch. s r bounds how far the ball reaches whatever the transform shears, and slack bounds
/// roundings of the two terms before it. So in floating point too, one that passes has only such below it that pass:
/// its ball holds theirs, its error is no smaller and its slack is larger. Passing is decided for each group by itself.
struct InstanceMetric {
  DVec3 x{0.0}, y{0.0}, z{0.0}, offset{0.0}; ///< M's linear part by columns; M's translation less the eye
  double stretch = 0.0, near = 0.0, error_per_distance = 0.0;
  double slack = 0.0;

  /// @param reach LodGeometry::reach() @param stretch of largest_stretch()
  InstanceMetric(const DetailView& view, const DAffine& world_from_object, double stretch_of_linear, double reach)
      : x(world_from_object[0]), y(world_from_object[1]), z(world_from_object[2]),
        offset(world_from_object[3] - view.eye), stretch(stretch_of_linear), near(view.near),
        error_per_distance(view.error_per_distance),
        slack(rounding_slack(extent(world_from_object, stretch_of_linear, reach), view)) {}

  /// Bound of what coordinates come up between object and world, for rounding_slack().
  static double extent(const DAffine& world_from_object, double stretch_of_linear, double reach) {
    return glm::length(world_from_object[3]) + 2.0 * stretch_of_linear * reach;
  }
  /// 2^-46 of all lengths that come up: 128 roundings, where a distance has about 20.
  static double rounding_slack(double extent, const DetailView& view) {
    return 0x1p-46 * (extent + glm::length(view.eye));
  }

  /// d above. @param level of the group
  double distance(double cx, double cy, double cz, double radius, double level) const {
    const double px = x.x * cx + y.x * cy + z.x * cz + offset.x;
    const double py = x.y * cx + y.y * cy + z.y * cz + offset.y;
    const double pz = x.z * cx + y.z * cy + z.z * cz + offset.z;
    const double d = std::sqrt(px * px + py * py + pz * pz) - stretch * radius - slack * (level + 1.0);
    return std::max(near, d);
  }

  bool passes(const LodRanks& ranks, size_t rank) const {
    return ranks.error[rank] * stretch <= error_per_distance * distance(ranks.center_x[rank], ranks.center_y[rank],
                                                                        ranks.center_z[rank], ranks.radius[rank],
                                                                        ranks.level[rank]);
  }
};

/// Bounds of what errors pass for an instance, from one distance: all groups of an error up to `near` pass, none above
/// `far` does. Object units.
struct AllowedErrors {
  double near = 0.0, far = 0.0;
};

/// The ball around a geometry in world space, as an instance has it, and what coordinates it was computed from.
struct InstanceBall {
  DVec3 center{0.0};    ///< world space
  double stretch = 0.0; ///< of largest_stretch()
  double extent = 0.0;  ///< InstanceMetric::extent()
};

/// Distance of the ball's center from the eye, and bound of roundings in all that follows from it.
struct BallDistance {
  double center = 0.0, slack = 0.0;
};
inline BallDistance ball_distance(const DetailView& view, const InstanceBall& ball) {
  // More slack than any group has, whatever its level.
  constexpr double kSlacks = baked::kMaxLodLevels + 2.0;
  return {glm::length(ball.center - view.eye), kSlacks * InstanceMetric::rounding_slack(ball.extent, view)};
}

/// @param error_per_distance DetailView's, or larger for instances that may be coarser
inline AllowedErrors allowed_errors(double near, double error_per_distance, const BallDistance& distance,
                                    double stretch, double radius) {
  constexpr double kDown = 1.0 - 0x1p-40, kUp = 1.0 + 0x1p-40; // the division, and s r
  const double d_near = std::max(near, distance.center - stretch * radius * kUp - distance.slack);
  const double d_far = std::max(near, distance.center + stretch * radius * kUp + distance.slack);
  return {error_per_distance * d_near / stretch * kDown, error_per_distance * d_far / stretch * kUp};
}

} // namespace packtrace
