#include "runtime/image/flip_stages.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace packtrace {

namespace {

/// Matrix whose columns are the XYZ values of linear sRGB red, green and blue. Source: exact fractions derived from the
/// primaries and the white point (x 0.3127, y 0.3290) of IEC 61966-2-1:1999.
const glm::dmat3& xyz_from_rgb() {
  static const glm::dmat3 matrix(10135552.0 / 24577794.0, 2613072.0 / 12288897.0, 1425312.0 / 73733382.0,
                                 8788810.0 / 24577794.0, 8788810.0 / 12288897.0, 8788810.0 / 73733382.0,
                                 4435075.0 / 24577794.0, 887015.0 / 12288897.0, 70074185.0 / 73733382.0);
  return matrix;
}

const DVec3& white_xyz() {
  static const DVec3 white = xyz_from_rgb() * DVec3(1.0);
  return white;
}

/// The function f of CIELAB: a cube root with a linear segment near 0.
double lab_f(double t) {
  constexpr double kDelta = 6.0 / 29.0;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
}

/// A Gaussian of the contrast sensitivity function's Fourier transform: a sqrt(pi / b) exp(-pi^2 x^2 / b), with x in
/// degrees.
struct CsfGaussian {
  double a = 0.0, b = 1.0;
};

std::vector<CsfGaussian> csf_gaussians(OpponentChannel channel) {
  switch (channel) {
  case OpponentChannel::kAchromatic:
    return {{1.0, 0.0047}};
  case OpponentChannel::kRedGreen:
    return {{1.0, 0.0053}};
  case OpponentChannel::kBlueYellow:
    return {{34.1, 0.04}, {13.5, 0.025}};
  }
  return {};
}

constexpr double kWidestCsf = 0.04; // b of the widest Gaussian; all kernels are cut off at three times its sigma

/// Scales the positive weights to sum 1 and the negative weights to sum -1.
void normalize_signs(std::vector<double>& kernel) {
  double positive = 0.0, negative = 0.0;
  for (const double weight : kernel) (weight > 0.0 ? positive : negative) += std::abs(weight);
  for (double& weight : kernel) weight /= weight > 0.0 ? positive : (negative > 0.0 ? negative : 1.0);
}

} // namespace

DVec3 ycxcz_from_linear_rgb(DVec3 rgb) {
  const DVec3 t = xyz_from_rgb() * rgb / white_xyz();
  return {116.0 * t.y - 16.0, 500.0 * (t.x - t.y), 200.0 * (t.y - t.z)};
}

DVec3 linear_rgb_from_ycxcz(DVec3 ycxcz) {
  static const glm::dmat3 rgb_from_xyz = glm::inverse(xyz_from_rgb());
  const double y = (ycxcz.x + 16.0) / 116.0;
  return rgb_from_xyz * (DVec3(y + ycxcz.y / 500.0, y, y - ycxcz.z / 200.0) * white_xyz());
}

DVec3 hunt_lab_from_linear_rgb(DVec3 rgb) {
  const DVec3 t = xyz_from_rgb() * rgb / white_xyz();
  const double fx = lab_f(t.x), fy = lab_f(t.y), fz = lab_f(t.z);
  const double lightness = 116.0 * fy - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (fx - fy), 0.01 * lightness * 200.0 * (fy - fz)};
}

double hyab_distance(DVec3 a, DVec3 b) {
  const DVec3 d = a - b;
  return std::abs(d.x) + std::sqrt(d.y * d.y + d.z * d.z);
}

double flip_max_color_distance() {
  static const double distance = std::pow(
      hyab_distance(hunt_lab_from_linear_rgb({0.0, 1.0, 0.0}), hunt_lab_from_linear_rgb({0.0, 0.0, 1.0})), 0.7);
  return distance;
}

double flip_color_error(double hyab) {
  const double most = flip_max_color_distance(), knee = 0.4 * most;
  const double distance = std::pow(hyab, 0.7);
  const double error = distance < knee ? 0.95 / knee * distance : 0.95 + 0.05 * (distance - knee) / (most - knee);
  return std::min(error, 1.0); // only rounding can exceed 1
}

std::vector<CsfTerm> csf_terms(OpponentChannel channel, double pixels_per_degree) {
  constexpr double kPi2 = std::numbers::pi * std::numbers::pi;
  const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(kWidestCsf / (2.0 * kPi2)) * pixels_per_degree));
  std::vector<CsfTerm> terms;
  double total = 0.0;
  for (const CsfGaussian& gaussian : csf_gaussians(channel)) {
    CsfTerm term;
    double sum = 0.0;
    for (int x = -radius; x <= radius; ++x) {
      const double degrees = x / pixels_per_degree;
      sum += term.kernel.emplace_back(std::exp(-kPi2 * degrees * degrees / gaussian.b));
    }
    for (double& weight : term.kernel) weight /= sum;
    term.share = gaussian.a * std::sqrt(std::numbers::pi / gaussian.b) * sum * sum;
    total += term.share;
    terms.push_back(std::move(term));
  }
  for (CsfTerm& term : terms) term.share /= total;
  return terms;
}

FeatureKernels feature_kernels(double pixels_per_degree) {
  constexpr double kFeatureWidth = 0.082; // peak-to-trough width of the human edge detector, degrees
  const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  FeatureKernels kernels;
  for (int x = -radius; x <= radius; ++x) {
    const double g = std::exp(-x * x / (2.0 * sigma * sigma));
    kernels.smooth.push_back(g);
    kernels.edge.push_back(-x * g);
    kernels.point.push_back((x * x / (sigma * sigma) - 1.0) * g);
  }
  normalize_signs(kernels.smooth);
  normalize_signs(kernels.edge);
  normalize_signs(kernels.point);
  return kernels;
}

} // namespace packtrace
