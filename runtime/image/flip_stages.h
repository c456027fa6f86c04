#pragma once

#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

// The stages of flip() that have values of their own to check. Source of all: Andersson et al. 2020 (metrics.h), with
// the section in brackets.

/// Linear opponent space, for the white point of linear sRGB: Y in [-16,100], red-green Cx, blue-yellow Cz. [4.1.1]
DVec3 ycxcz_from_linear_rgb(DVec3 rgb);
DVec3 linear_rgb_from_ycxcz(DVec3 ycxcz);

/// CIELAB (L in [0,100]) with the Hunt adjustment: a and b scaled by L / 100. [4.1.2]
DVec3 hunt_lab_from_linear_rgb(DVec3 rgb);

/// HyAB distance: |dL| + |(da, db)|. [4.1.3]
double hyab_distance(DVec3 a, DVec3 b);

/// The largest HyAB distance of sRGB colours (green and blue) to the power 0.7: the paper's c_max. [4.1.3]
double flip_max_color_distance();

/// HyAB distance to a colour error in [0,1]: power 0.7, then [0, 0.4 c_max] to [0, 0.95] and the rest to [0.95, 1].
/// [4.1.3]
double flip_color_error(double hyab);

/// One Gaussian of a contrast sensitivity filter; the filter is the sum over its terms of share * kernel (x) kernel.
struct CsfTerm {
  double share = 0.0;         ///< shares of a channel add up to 1
  std::vector<double> kernel; ///< odd count of weights, sum 1
};

enum class OpponentChannel { kAchromatic, kRedGreen, kBlueYellow };

/// Contrast sensitivity filter of a channel in pixels. [4.1.1, table 1]
std::vector<CsfTerm> csf_terms(OpponentChannel channel, double pixels_per_degree);

/// Kernels of the feature detectors; positive and negative weights add up to 1 and -1 each. [4.2]
struct FeatureKernels {
  std::vector<double> smooth; ///< Gaussian, sum 1
  std::vector<double> edge;   ///< its first derivative
  std::vector<double> point;  ///< its second derivative
};
FeatureKernels feature_kernels(double pixels_per_degree);

} // namespace packtrace
