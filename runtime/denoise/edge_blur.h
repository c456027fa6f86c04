#pragma once

#include "runtime/denoise/edge_weights.h"
#include "runtime/denoise/plane.h"

namespace packtrace {

/// An image on its way through the blurs.
struct NoisyImage {
  Plane<float> value;
  Plane<float> inverse_variance; ///< 1 / variance of the noise left in `value`
  std::vector<float> youngest;   ///< per row: least tspp of its pixels; misses do not count

  void resize(ImageSize size) {
    value.resize(size), inverse_variance.resize(size);
    youngest.assign(size.height, 0.0f);
  }
};

/// Strength of a blur by the frames of history: 1 up to `begin`, falling linearly to 0 at `end`.
struct Fade {
  float begin = 0, end = 1;
};

/// Memory of edge_blur between its steps; one object serves any number of calls for images of one size.
struct BlurScratch {
  std::array<Plane<uint8_t>, 4> weights; ///< as EdgeWeights, times the value weights
  NoisyImage image;

  void resize(ImageSize size) {
    for (Plane<uint8_t>& plane : weights) plane.resize(size);
    image.resize(size);
  }
};

/// One 3 x 3 pass with taps step pixels apart, in flux form:
///   out_p = v_p + s_p sum_q g_pq e_pq k_pq (v_q - v_p)
/// with g a normalised Gaussian (.27901 .44198 .27901 per axis), e the edge weights and k what the values say:
///   k_pq = saturate((limit - D) / (limit - 1.2))^2,  D = mean_o (v_(q+o) - v_(p+o))^2 min(precision) / 2
/// over the 3 x 3 patch of offsets o, as far as p + o and q + o lie on one surface. D is 1 in expectation if noise is
/// the only difference, and as a mean it stays near 1: comparing patches tells an edge from noise where single pixels
/// cannot. Source: A. Buades, B. Coll, J.-M. Morel, "A non-local algorithm for image denoising", 2005.
/// g e k is the same from both ends: what one pixel gains the other loses, so the mean of a surface stays what it was
/// whatever the values do to the weights. Weights that are divided by their sum pull skewed noise towards its majority
/// instead. Constants pass exactly, and results never leave the range of their inputs.
/// The precision of the result takes the neighbours' noise for independent and as large as the pixel's own; half the
/// gain that this predicts, as an exponent, is booked.
/// @param limit above 1.2
/// @param samples tspp of the pixels, which sets s; nothing happens if s is 0 everywhere
void edge_blur(const EdgeWeights& edges, const Plane<float>& samples, Fade fade, float limit, ImageSize size,
               NoisyImage& image, BlurScratch& scratch);

} // namespace packtrace
