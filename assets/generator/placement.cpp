#include "assets/generator/placement.h"

#include <algorithm>
#include <cmath>

namespace packtrace::scenegen {

SinCos sin_cos(double angle_rad) {
  // pi/2 in two parts keeps the reduced angle accurate to 2^-80 over the stated range.
  constexpr double kHalfPiHigh = 0x1.921fb544p+0, kHalfPiLow = 0x1.0b4611a626331p-34;
  const double quarter = std::floor(angle_rad / (kPi / 2) + 0.5);
  const double x = (angle_rad - quarter * kHalfPiHigh) - quarter * kHalfPiLow;
  const double x2 = x * x;
  double sine = 1.0, cosine = 1.0; // Taylor series in Horner form; |x| <= pi/4, so the first omitted term is < 1e-16
  for (int k = 8; k >= 1; --k) {
    sine = 1.0 - sine * x2 / ((2.0 * k) * (2.0 * k + 1.0));
    cosine = 1.0 - cosine * x2 / ((2.0 * k - 1.0) * (2.0 * k));
  }
  sine *= x;
  switch (static_cast<int64_t>(quarter) & 3) {
  case 0:
    return {sine, cosine};
  case 1:
    return {cosine, -sine};
  case 2:
    return {-sine, -cosine};
  default:
    return {-cosine, sine};
  }
}

double smooth_step(double edge0, double edge1, double x) {
  const double t = std::clamp((x - edge0) / (edge1 - edge0), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

double mix(double a, double b, double t) { return a + (b - a) * t; }

DAffine translation(DVec3 offset) {
  DAffine result(1.0);
  result[3] = offset;
  return result;
}

DAffine scaling(DVec3 factors) {
  return DAffine(DVec3(factors.x, 0, 0), DVec3(0, factors.y, 0), DVec3(0, 0, factors.z), DVec3(0.0));
}

DAffine rotation_x(double angle_rad) {
  const auto [s, c] = sin_cos(angle_rad);
  return DAffine(DVec3(1, 0, 0), DVec3(0, c, s), DVec3(0, -s, c), DVec3(0.0));
}

DAffine rotation_y(double angle_rad) {
  const auto [s, c] = sin_cos(angle_rad);
  return DAffine(DVec3(c, 0, -s), DVec3(0, 1, 0), DVec3(s, 0, c), DVec3(0.0));
}

DAffine rotation_z(double angle_rad) {
  const auto [s, c] = sin_cos(angle_rad);
  return DAffine(DVec3(c, s, 0), DVec3(-s, c, 0), DVec3(0, 0, 1), DVec3(0.0));
}

DAffine stand_at(DVec3 place, double turn_rad, double scale) {
  return compose(translation(place), compose(rotation_y(turn_rad), scaling(DVec3(scale))));
}

DAffine along(DVec3 origin, DVec3 direction) {
  const DVec3 y = glm::normalize(direction);
  const DVec3 helper = std::abs(y.y) < 0.9 ? DVec3(0, 1, 0) : DVec3(1, 0, 0);
  const DVec3 x = glm::normalize(glm::cross(helper, y));
  return DAffine(x, y, glm::cross(x, y), origin);
}

DVec3 random_direction(Random& random) {
  const double y = random.uniform(-1.0, 1.0);
  const auto [s, c] = sin_cos(random.uniform(0.0, 2.0 * kPi));
  const double ring = std::sqrt(std::max(0.0, 1.0 - y * y));
  return {ring * c, y, ring * s};
}

} // namespace packtrace::scenegen
