#pragma once

#include "runtime/denoise/edge_weights.h"
#include "runtime/denoise/plane.h"

namespace packtrace {

/// An image on its way through the blurs.
struct NoisyImage {
  Plane<float> value;
  Plane<float> precision;      ///< 1 / variance of the noise left in `value`
  std::vector<float> youngest; ///< per row: least tspp of its pixels; misses do not count

  void resize(ImageSize size) {
    value.resize(size), precision.resize(size);
    youngest.assign(size.height, 0.0f);
  }
};

/// Strength of a blur by the frames of history: 1 up to `begin`, falling linearly to 0 at `end`.
struct Fade {
  float begin = 0, end = 1;
};

/// One 3 x 3 pass with taps step pixels apart, in flux form:
///   out_p = v_p + s_p sum_q g_pq e_pq k_pq (v_q - v_p),
///   k_pq = max(0, 1 - (v_q - v_p)^2 min(precision_p, precision_q) / (2 c^2))^2
/// with g a normalised Gaussian (.27901 .44198 .27901 per axis) and e the edge weights. g e k is the same from both
/// ends: what one pixel gains the other loses, so the mean of a surface stays what it was whatever the values do to the
/// weights. Weights that are divided by their sum pull skewed noise towards its majority instead. Constants pass
/// exactly, and results never leave the range of their inputs.
/// The precision of the result takes the neighbours' noise for independent and as large as the pixel's own.
/// @param samples tspp of the pixels, which sets s
/// @param sigma c, standard deviations
/// @param scratch holds intermediate results; of the same size. Nothing happens if s is 0 everywhere.
void edge_blur(const EdgeWeights& edges, const Plane<float>& samples, Fade fade, float sigma, ImageSize size,
               NoisyImage& image, NoisyImage& scratch);

} // namespace packtrace
