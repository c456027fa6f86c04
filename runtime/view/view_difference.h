#pragma once

#include <string>

#include "runtime/frame/rendered_image.h"
#include "runtime/image/image.h"

namespace packtrace {

/// Difference of two images over the pixels that show a surface in both.
struct DifferenceMetrics {
  double rmse = 0, psnr = 0, flip = 0;
  uint64_t pixels = 0; ///< 0: nothing to compare; the other members are undefined
};

/// The values of a layer that are compared: ao, ao_raw, shaded and albedo as they are, normals as 0.5 + 0.5 n, other
/// layers divided by `scale`. Linear; one or three channels.
Image comparable_layer(const RenderedImage& image, const std::string& layer, float scale);
/// The value of a layer that comparable_layer() maps to 1: 1, or the 99th percentile of the positive values.
float comparable_scale(const RenderedImage& image, const std::string& layer);

/// Compares a layer of an image with a layer of a reference of the same size.
/// Throws Error(kUsage) for pictures of different sizes or numbers of channels.
DifferenceMetrics difference_metrics(const RenderedImage& test, const std::string& test_layer,
                                     const RenderedImage& reference, const std::string& reference_layer);

/// The difference of two layers as a heat map, magnified. Grey where only one of them shows a surface.
/// @param gain differences of 1 / gain are white; positive
Image difference_picture(const RenderedImage& test, const std::string& test_layer, const RenderedImage& reference,
                         const std::string& reference_layer, float gain);

} // namespace packtrace
