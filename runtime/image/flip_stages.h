#pragma once

#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

// Stages of flip() that can be tested one by one. Source of all: Andersson et al. 2020 (metrics.h); the section is
// given in brackets.

/// The linear opponent colour space YCxCz with the white point of linear sRGB: Y in [-16,100], red-green Cx,
/// blue-yellow Cz. [4.1.1]
DVec3 ycxcz_from_linear_rgb(DVec3 rgb);
DVec3 linear_rgb_from_ycxcz(DVec3 ycxcz);

/// CIELAB (L in [0,100]) with the Hunt adjustment: a and b scaled by L / 100. [4.1.2]
DVec3 hunt_lab_from_linear_rgb(DVec3 rgb);

/// HyAB distance: |dL| + |(da, db)|. [4.1.3]
double hyab_distance(DVec3 a, DVec3 b);

/// The largest HyAB distance between sRGB colours (green and blue) to the power 0.7: the paper's c_max. [4.1.3]
double flip_max_color_distance();

/// Maps a HyAB distance to a colour error in [0,1]: the distance to the power 0.7 is mapped linearly from
/// [0, 0.4 c_max] to [0, 0.95] and from [0.4 c_max, c_max] to [0.95, 1]. [4.1.3]
double flip_color_error(double hyab);

/// A separable Gaussian term of a contrast sensitivity filter. The filter is the sum of share * (kernel (x) kernel)
/// over its terms.
struct CsfTerm {
  double share = 0.0;         ///< shares of a channel add up to 1
  std::vector<double> kernel; ///< odd number of weights with sum 1
};

enum class OpponentChannel { kAchromatic, kRedGreen, kBlueYellow };

/// Contrast sensitivity filter of a channel, with kernels sampled per pixel. [4.1.1, table 1]
std::vector<CsfTerm> csf_terms(OpponentChannel channel, double pixels_per_degree);

/// Kernels of the edge and point detectors. The positive weights of a kernel add up to 1, the negative ones to -1.
/// [4.2]
struct FeatureKernels {
  std::vector<double> smooth; ///< Gaussian, sum 1
  std::vector<double> edge;   ///< its first derivative
  std::vector<double> point;  ///< its second derivative
};
FeatureKernels feature_kernels(double pixels_per_degree);

} // namespace packtrace
