#pragma once

#include "assets/generator/random.h"
#include "pbrt_import/scene/math.h"

namespace packtrace::scenegen {

inline constexpr double kPi = 3.14159265358979323846;
constexpr double radians(double degrees) { return degrees * (kPi / 180.0); }

struct SinCos {
  double sin = 0.0;
  double cos = 1.0;
};

/// Sine and cosine with an error of about 1e-15 for |angle| < 1e6, from additions and multiplications only: those of
/// the C library differ in the last bit between machines, and generated files must not differ.
SinCos sin_cos(double angle_rad);

/// Smooth step from 0 to 1 between the edges; constant outside.
double smooth_step(double edge0, double edge1, double x);
/// Linear interpolation: a at t = 0, b at t = 1.
double mix(double a, double b, double t);

DAffine translation(DVec3 offset);
DAffine scaling(DVec3 factors);
DAffine rotation_x(double angle_rad);
DAffine rotation_y(double angle_rad); ///< maps +z to (sin, 0, cos)
DAffine rotation_z(double angle_rad);

/// Transform that places an object: uniformly scaled, rotated about +y, then moved to `place`.
DAffine stand_at(DVec3 place, double turn_rad, double scale = 1.0);

/// A frame whose y axis has the direction `direction` (of any nonzero length); its x and z axes are arbitrary.
DAffine along(DVec3 origin, DVec3 direction);

/// Uniformly distributed on the unit sphere.
DVec3 random_direction(Random& random);

} // namespace packtrace::scenegen
