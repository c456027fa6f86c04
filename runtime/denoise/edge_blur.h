#pragma once

#include "runtime/denoise/edge_weights.h"
#include "runtime/denoise/plane.h"

namespace packtrace {

/// AO between blur passes, with an estimate of its noise.
struct NoisyImage {
  Plane<float> value;
  Plane<float> inverse_variance; ///< 1 / variance of the noise left in `value`
  std::vector<float> min_tspp;   ///< per row: smallest tspp of its hit pixels

  void resize(ImageSize size) {
    value.resize(size), inverse_variance.resize(size);
    min_tspp.assign(size.height, 0.0f);
  }
};

/// Blur strength as a function of history length in frames: 1 up to `begin`, then linear to 0 at `end`.
struct Fade {
  float begin = 0, end = 1;
};

/// Scratch memory for edge_blur(), reusable for all images of one size.
struct BlurScratch {
  std::array<Plane<uint8_t>, 4> weights; ///< edge weight times value weight per direction, laid out as in EdgeWeights
  NoisyImage image;

  void resize(ImageSize size) {
    for (Plane<uint8_t>& plane : weights) plane.resize(size);
    image.resize(size);
  }
};

/// One 3 x 3 blur pass whose taps are edges.step() pixels apart, in flux form:
///   out_p = v_p + s_p sum_q g_pq e_pq k_pq (v_q - v_p)
/// g is a normalised Gaussian (0.27901 0.44198 0.27901 per axis), e the edge weights, s the strength from `fade`, and k
/// the value weights:
///   k_pq = saturate((limit - D) / (limit - 1.2))^2,  D = mean_o (v_(q+o) - v_(p+o))^2 min(precision) / 2
/// D is averaged over those offsets o of a 3 x 3 patch where p + o and q + o lie on the same surface. If noise is the
/// only difference between two patches, D is 1 in expectation and, being a mean, close to 1. Comparing patches
/// therefore separates edges from noise where single pixels cannot.
/// Source: A. Buades, B. Coll, J.-M. Morel, "A non-local algorithm for image denoising", 2005.
///
/// The weights g e k are symmetric in p and q. Where s is 1, one pixel gains what the other loses, so the mean of a
/// surface is preserved for any dependence of the weights on the values. (Weights normalised by their sum would instead
/// pull skewed noise towards its most frequent values.) Constant images pass unchanged, and results stay within the
/// range of their inputs.
/// The new precision assumes that the neighbours' noise is independent of the pixel's and equally large. Only the
/// square root of the gain predicted by this assumption is applied.
/// @param samples tspp per pixel, which determines s; the image stays as it is if s is 0 in all rows
/// @param limit above 1.2
void edge_blur(const EdgeWeights& edges, const Plane<float>& samples, Fade fade, float limit, ImageSize size,
               NoisyImage& image, BlurScratch& scratch);

} // namespace packtrace
