#pragma once

#include <cstdint>
#include <span>

#include "runtime/image/image.h"

namespace packtrace {

/// Which pixels count, and what to return.
struct MetricOptions {
  /// One entry per pixel, non-zero where both images have a value (kInvalidAo is none); empty: all pixels count.
  std::span<const uint8_t> valid;
  bool error_map = false; ///< fill Metric::error_map
};

struct Metric {
  double value = 0.0;
  Image error_map; ///< one channel, 0 = no error at this pixel or not counted; empty unless asked for
};

// All metrics need two images of one size and channel count whose counted samples are finite, and at least one pixel to
// count. They throw Error(kInput) otherwise. Results are the same for any number of threads. All are symmetric in
// their images.

/// Root of the mean squared difference over counted pixels and channels. Map: the same per pixel.
Metric rmse(const Image& test, const Image& reference, const MetricOptions& options = {});

/// Mean absolute difference over counted pixels and channels. Map: the same per pixel.
Metric mae(const Image& test, const Image& reference, const MetricOptions& options = {});

/// Peak signal-to-noise ratio in dB for the peak value 1: -20 log10(rmse); +infinity for equal images. Map: rmse()'s.
Metric psnr(const Image& test, const Image& reference, const MetricOptions& options = {});

/// Smallest width and height that ssim() accepts, pixels: its window.
inline constexpr uint32_t kSsimWindow = 11;

/// Mean structural similarity, 1 for equal images, > -1: Gaussian window of 11 x 11 pixels and sigma 1.5, K1 = 0.01,
/// K2 = 0.03, data range 1. Channels are compared one by one and averaged. Only windows that lie inside the image count
/// (a border of 5 pixels does not); inside a window, statistics are those of its counted pixels.
/// Map: 1 - SSIM. Throws Error(kInput) also where no window counts, as in images smaller than kSsimWindow.
/// Source: Z. Wang, A. Bovik, H. Sheikh, E. Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
/// Similarity", 2004, equations 13-17.
Metric ssim(const Image& test, const Image& reference, const MetricOptions& options = {});

/// An observer 0.7 m away from a 0.7 m wide screen of 3840 pixels: 3840 pi/180, about 67.
inline constexpr double kFlipPixelsPerDegree = 67.020643276582;

/// Mean perceived difference of two images when alternated, in [0,1]; images are linear, with 1 or 3 channels, and
/// clamped to [0,1]. Pixels that do not count are black in both. Map: the same per pixel.
/// @param pixels_per_degree of visual angle, in (0, 1000]
/// Throws Error(kInput) also for other channel counts, Error(kUsage) for pixels_per_degree out of range.
/// Source: P. Andersson, J. Nilsson, T. Akenine-Moller, M. Oskarsson, K. Astrom, M. Fairchild, "FLIP: A Difference
/// Evaluator for Alternating Images", 2020.
Metric flip(const Image& test, const Image& reference, const MetricOptions& options = {},
            double pixels_per_degree = kFlipPixelsPerDegree);

} // namespace packtrace
