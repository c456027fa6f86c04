#pragma once

#include <algorithm>
#include <cmath>

#include "pbrt_import/scene/math.h"
#include "runtime/lod/lod_geometry.h"

namespace packtrace {

/// The viewpoint that detail is chosen for. World space.
struct DetailView {
  DVec3 eye{0.0};
  double near = 0.0;               ///< minimum distance of anything; above 0
  double error_per_distance = 0.0; ///< allowed error per distance: the tangent of its angle
};

/// The only place where pixels are converted to a tangent. `error_px` is a radius: how far in pixels a surface may lie
/// to either side of level 0, in the middle of the image. Towards the image's edges, the error in pixels is slightly
/// larger.
///   error_per_distance = error_px tan(fov_y / 2) / (height_px / 2)
/// @param fov_y_rad full vertical field of view, in (0, pi)
/// Throws Error(kUsage) if a value is out of range or not finite.
DetailView make_detail_view(DVec3 eye_world, double near_world, double fov_y_rad, double height_px, double error_px);

/// The largest singular value of the linear part: no vector is stretched more. Rounded up by a factor of 1 + 1e-7, the
/// accuracy if the two largest values are equal. At least 1e-300.
/// Throws Error(kInput) if the transform is not finite or beyond 1e100.
double largest_stretch(const DAffine& world_from_object);

/// The LOD metric for one instance and view.
///
/// A group with error E and bounding sphere (c, r) passes, that is, may be replaced by its coarser version, if
///   E s <= T d,   d = max(near, |M c - eye| - s r - slack (level + 1))
/// where s is the largest stretch. s r bounds the sphere's radius in world space under any shear, and slack bounds the
/// rounding errors of both terms before it. If a group passes, all groups below it pass, in floating point too: its
/// sphere contains theirs, its error is not smaller and its slack is larger. So groups can be tested independently.
struct InstanceMetric {
  DVec3 x{0.0}, y{0.0}, z{0.0}, offset{0.0}; ///< columns of M's linear part; M's translation minus the eye
  double stretch = 0.0, near = 0.0, error_per_distance = 0.0;
  double slack = 0.0;

  /// @param stretch_of_linear result of largest_stretch()
  /// @param reach LodGeometry::reach()
  InstanceMetric(const DetailView& view, const DAffine& world_from_object, double stretch_of_linear, double reach)
      : x(world_from_object[0]), y(world_from_object[1]), z(world_from_object[2]),
        offset(world_from_object[3] - view.eye), stretch(stretch_of_linear), near(view.near),
        error_per_distance(view.error_per_distance),
        slack(rounding_slack(extent(world_from_object, stretch_of_linear, reach), view)) {}

  /// Upper bound of the coordinates that occur in a transform from object to world space, for rounding_slack().
  static double extent(const DAffine& world_from_object, double stretch_of_linear, double reach) {
    return glm::length(world_from_object[3]) + 2.0 * stretch_of_linear * reach;
  }
  /// 2^-46 of all lengths involved: room for 128 rounding errors, of which a distance has about 20.
  static double rounding_slack(double extent, const DetailView& view) {
    return 0x1p-46 * (extent + glm::length(view.eye));
  }

  /// The distance d above.
  /// @param level of the group
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

/// Bounds of the errors that pass for an instance, in object units: all groups with an error up to `near` pass, and
/// none with an error above `far`.
struct AllowedErrors {
  double near = 0.0, far = 0.0;
};

/// A geometry's bounding sphere in world space for one instance, with the data for its rounding errors.
struct InstanceBall {
  DVec3 center{0.0};    ///< world space
  double stretch = 0.0; ///< result of largest_stretch()
  double extent = 0.0;  ///< InstanceMetric::extent()
};

/// Distance of the sphere's centre from the eye, with a bound of the rounding errors in everything computed from it.
struct BallDistance {
  double center = 0.0, slack = 0.0;
};
inline BallDistance ball_distance(const DetailView& view, const InstanceBall& ball) {
  // Larger than the slack of any group at any level.
  constexpr double kSlacks = baked::kMaxLodLevels + 2.0;
  return {glm::length(ball.center - view.eye), kSlacks * InstanceMetric::rounding_slack(ball.extent, view)};
}

/// @param error_per_distance as in DetailView, or larger for instances that may be coarser
inline AllowedErrors allowed_errors(double near, double error_per_distance, const BallDistance& distance,
                                    double stretch, double radius) {
  constexpr double kDown = 1.0 - 0x1p-40, kUp = 1.0 + 0x1p-40; // cover rounding of the division and of s r
  const double d_near = std::max(near, distance.center - stretch * radius * kUp - distance.slack);
  const double d_far = std::max(near, distance.center + stretch * radius * kUp + distance.slack);
  return {error_per_distance * d_near / stretch * kDown, error_per_distance * d_far / stretch * kUp};
}

} // namespace packtrace
