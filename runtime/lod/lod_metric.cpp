#include "runtime/lod/lod_metric.h"

#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr double kLargest = 1e100; // keeps squares of coordinates finite
constexpr double kSmallestStretch = 1e-300;

/// Largest eigenvalue of a positive semidefinite symmetric matrix, by the trigonometric solution of its characteristic
/// polynomial.
/// Source: O. K. Smith, Eigenvalues of a symmetric 3 x 3 matrix, CACM 4(4), 1961.
double largest_eigenvalue(const glm::dmat3& a) {
  const double mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
  const double off = a[1][0] * a[1][0] + a[2][0] * a[2][0] + a[2][1] * a[2][1];
  const DVec3 diagonal(a[0][0] - mean, a[1][1] - mean, a[2][2] - mean);
  const double p = std::sqrt((glm::dot(diagonal, diagonal) + 2.0 * off) / 6.0);
  if (!(p > 0.0)) return mean;
  glm::dmat3 b = a;
  for (int i = 0; i < 3; ++i) b[i][i] -= mean;
  const double half_determinant = std::clamp(glm::determinant(b / p) * 0.5, -1.0, 1.0);
  return mean + 2.0 * p * std::cos(std::acos(half_determinant) / 3.0);
}

} // namespace

DetailView make_detail_view(DVec3 eye_world, double near_world, double fov_y_rad, double height_px, double error_px) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw Error(ErrorKind::kUsage, std::string("view of levels of detail: ") + what);
  };
  for (int axis = 0; axis < 3; ++axis) require(std::abs(eye_world[axis]) <= kLargest, "the eye is not finite");
  require(near_world > 0.0 && near_world <= kLargest, "the near plane is not above 0");
  require(fov_y_rad > 0.0 && fov_y_rad < 3.14159265358979, "the field of view is not between 0 and 180 degrees");
  require(height_px > 0.0 && height_px <= 1e9, "the image has no height");
  require(error_px >= 0.0 && error_px <= 1e9, "the error is not between 0 and 1e9 pixels");
  return {eye_world, near_world, error_px * std::tan(0.5 * fov_y_rad) / (0.5 * height_px)};
}

double largest_stretch(const DAffine& world_from_object) {
  double largest = 0.0;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) {
      const double value = std::abs(world_from_object[column][row]);
      if (!(value <= kLargest)) throw Error(ErrorKind::kInput, "the transform of an instance is not finite");
      if (column < 3) largest = std::max(largest, value);
    }
  if (largest == 0.0) return kSmallestStretch;
  // scaled so that squares neither overflow nor underflow
  const glm::dmat3 linear = glm::dmat3(world_from_object) / largest;
  const double stretch = largest * std::sqrt(largest_eigenvalue(glm::transpose(linear) * linear));
  return std::max(kSmallestStretch, stretch * (1.0 + 1e-7));
}

} // namespace packtrace
