#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "pbrt_import/base/error.h"
#include "runtime/image/flip_stages.h"
#include "runtime/image/metric_support.h"

namespace packtrace {

namespace {

/// An image as the observer perceives it.
struct Seen {
  std::array<ImagePlane, 3> color; ///< Hunt-adjusted L, a, b of the filtered image
  ImagePlane edges;                ///< edge and point strength in the unfiltered luminance
  ImagePlane points;
};

/// Planes Y, Cx, Cz of the image clamped to [0,1]. Pixels that do not count are black.
std::array<ImagePlane, 3> opponent_planes(const Image& image, std::span<const uint8_t> valid) {
  std::array<ImagePlane, 3> planes;
  for (ImagePlane& plane : planes) plane.resize(image.size.pixels());
  for_each_row(image.size, [&](uint32_t y) {
    for (size_t i = size_t{y} * image.size.width; i < (size_t{y} + 1) * image.size.width; ++i) {
      DVec3 rgb(0.0);
      for (int c = 0; c < 3 && counts(valid, i); ++c)
        rgb[c] = std::clamp(double{image.data[i * image.channels + (image.channels == 3 ? static_cast<size_t>(c) : 0)]},
                            0.0, 1.0);
      const DVec3 opponent = ycxcz_from_linear_rgb(rgb);
      for (int c = 0; c < 3; ++c) planes[static_cast<size_t>(c)][i] = opponent[c];
    }
  });
  return planes;
}

ImagePlane filter_contrast(const ImagePlane& plane, ImageSize size, const std::vector<CsfTerm>& terms) {
  ImagePlane sum(plane.size(), 0.0);
  for (const CsfTerm& term : terms) {
    const ImagePlane filtered = filter_columns(filter_rows(plane, size, term.kernel), size, term.kernel);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += term.share * filtered[i];
  }
  return sum;
}

/// Feature strength per pixel: the length of the vector of the detector's responses along x and along y.
ImagePlane detect(const ImagePlane& smooth_rows, const ImagePlane& smooth_columns, ImageSize size,
                  const std::vector<double>& detector) {
  ImagePlane strength = filter_rows(smooth_columns, size, detector);
  const ImagePlane along_y = filter_columns(smooth_rows, size, detector);
  for (size_t i = 0; i < strength.size(); ++i)
    strength[i] = std::sqrt(strength[i] * strength[i] + along_y[i] * along_y[i]);
  return strength;
}

Seen see(const Image& image, std::span<const uint8_t> valid, double pixels_per_degree) {
  const ImageSize size = image.size;
  std::array<ImagePlane, 3> opponent = opponent_planes(image, valid);

  Seen seen;
  ImagePlane luminance = opponent[0];
  for (double& value : luminance) value = (value + 16.0) / 116.0;
  const FeatureKernels kernels = feature_kernels(pixels_per_degree);
  const ImagePlane rows = filter_rows(luminance, size, kernels.smooth);
  const ImagePlane columns = filter_columns(luminance, size, kernels.smooth);
  seen.edges = detect(rows, columns, size, kernels.edge);
  seen.points = detect(rows, columns, size, kernels.point);

  constexpr std::array kChannels{OpponentChannel::kAchromatic, OpponentChannel::kRedGreen,
                                 OpponentChannel::kBlueYellow};
  for (size_t c = 0; c < 3; ++c)
    seen.color[c] = filter_contrast(opponent[c], size, csf_terms(kChannels[c], pixels_per_degree));
  for_each_row(size, [&](uint32_t y) {
    for (size_t i = size_t{y} * size.width; i < (size_t{y} + 1) * size.width; ++i) {
      const DVec3 rgb = linear_rgb_from_ycxcz({seen.color[0][i], seen.color[1][i], seen.color[2][i]});
      const DVec3 lab = hunt_lab_from_linear_rgb(glm::clamp(rgb, 0.0, 1.0));
      for (int c = 0; c < 3; ++c) seen.color[static_cast<size_t>(c)][i] = lab[c];
    }
  });
  return seen;
}

double difference(const Seen& test, const Seen& reference, size_t i) {
  const auto color = [i](const Seen& seen) { return DVec3(seen.color[0][i], seen.color[1][i], seen.color[2][i]); };
  const double color_error = flip_color_error(hyab_distance(color(test), color(reference)));
  const double feature =
      std::max(std::abs(test.edges[i] - reference.edges[i]), std::abs(test.points[i] - reference.points[i]));
  const double feature_error = std::sqrt(std::min(feature * std::numbers::sqrt2 / 2.0, 1.0));
  return std::pow(color_error, 1.0 - feature_error);
}

} // namespace

Metric flip(const Image& test, const Image& reference, const MetricOptions& options, double pixels_per_degree) {
  check_comparable(test, reference, options.valid);
  if (test.channels != 1 && test.channels != 3)
    throw Error(ErrorKind::kInput, "FLIP needs images with 1 or 3 channels, not " + std::to_string(test.channels));
  if (!(pixels_per_degree > 0.0 && pixels_per_degree <= 1000.0))
    throw Error(ErrorKind::kUsage, "pixels per degree must be in (0, 1000]");
  const Seen test_seen = see(test, options.valid, pixels_per_degree);
  const Seen reference_seen = see(reference, options.valid, pixels_per_degree);
  const Image map =
      map_over(test.size, options.valid, [&](size_t i) { return difference(test_seen, reference_seen, i); });
  Metric metric;
  metric.value = mean_over(test.size, options.valid, [&](size_t i) { return double{map.data[i]}; });
  if (options.error_map) metric.error_map = map;
  return metric;
}

} // namespace packtrace
