#pragma once

#include <cstdint>
#include <span>

#include "runtime/image/image.h"

namespace packtrace {

/// Selects the pixels to compare and the results to return.
struct MetricOptions {
  /// One entry per pixel, nonzero where the pixel counts; empty: all pixels count. Pixels with kInvalidAo in either
  /// image should not count.
  std::span<const uint8_t> valid;
  bool error_map = false; ///< fill Metric::error_map
};

struct Metric {
  double value = 0.0;
  Image error_map; ///< one channel; 0 where there is no error or the pixel does not count; empty unless requested
};

// All metrics need two images of equal size and channel count, finite samples at all counted pixels, and at least one
// counted pixel. Otherwise they throw Error(kInput). Results do not depend on the number of threads or on the order of
// the two images.

/// Root mean squared difference over counted pixels and channels. Map: the same per pixel.
Metric rmse(const Image& test, const Image& reference, const MetricOptions& options = {});

/// Mean absolute difference over counted pixels and channels. Map: the same per pixel.
Metric mae(const Image& test, const Image& reference, const MetricOptions& options = {});

/// 99th percentile of the absolute difference per pixel, the mean over its channels: the smallest difference that at
/// least 99 % of the counted pixels do not exceed. Map: as mae().
Metric p99(const Image& test, const Image& reference, const MetricOptions& options = {});

/// Peak signal-to-noise ratio in dB for the peak value 1: -20 log10(rmse); +infinity for equal images. Map: as rmse().
Metric psnr(const Image& test, const Image& reference, const MetricOptions& options = {});

/// Side of the window of ssim() in pixels, which is the smallest image width and height it accepts.
inline constexpr uint32_t kSsimWindow = 11;

/// Mean structural similarity in (-1, 1], where 1 means equal images. Gaussian window of 11 x 11 pixels with sigma 1.5,
/// K1 = 0.01, K2 = 0.03, data range 1. SSIM is averaged over channels. Only windows that lie inside the image and whose
/// centre pixel counts are used (a border of 5 pixels is not); their statistics cover their counted pixels.
/// Map: 1 - SSIM. Also throws Error(kInput) if there is no such window, as in images smaller than kSsimWindow.
/// Source: Z. Wang, A. Bovik, H. Sheikh, E. Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
/// Similarity", 2004, equations 13-17.
Metric ssim(const Image& test, const Image& reference, const MetricOptions& options = {});

/// Pixels per degree of visual angle for an observer 0.7 m away from a 0.7 m wide screen with 3840 pixels: 3840 pi/180.
inline constexpr double kFlipPixelsPerDegree = 67.020643276582;

/// Mean perceived difference of two alternated images, in [0,1]. Images are linear, have 1 or 3 channels, and are
/// clamped to [0,1]. Pixels that do not count are set to black in both. Map: the same per pixel.
/// @param pixels_per_degree pixels per degree of visual angle, in (0, 1000]
/// Also throws Error(kInput) for other channel counts, and Error(kUsage) for pixels_per_degree out of range.
/// Source: P. Andersson, J. Nilsson, T. Akenine-Moller, M. Oskarsson, K. Astrom, M. Fairchild, "FLIP: A Difference
/// Evaluator for Alternating Images", 2020.
Metric flip(const Image& test, const Image& reference, const MetricOptions& options = {},
            double pixels_per_degree = kFlipPixelsPerDegree);

} // namespace packtrace
