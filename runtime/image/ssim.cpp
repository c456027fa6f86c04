#include <algorithm>
#include <array>
#include <cmath>

#include "pbrt_import/base/error.h"
#include "runtime/image/metric_support.h"

namespace packtrace {

namespace {

constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03; // (K1 L)^2 and (K2 L)^2 for the data range L = 1
constexpr uint32_t kRadius = kSsimWindow / 2;

std::array<double, kSsimWindow> window() {
  std::array<double, kSsimWindow> weights{};
  double sum = 0.0;
  for (uint32_t i = 0; i < kSsimWindow; ++i) {
    const double x = static_cast<double>(i) - kRadius;
    sum += weights[i] = std::exp(-x * x / (2.0 * 1.5 * 1.5));
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Gaussian-weighted mean of value(pixel index) over the window around each pixel. Pixels that do not count have
/// weight 0.
class WindowMean {
public:
  WindowMean(ImageSize size, std::span<const uint8_t> valid) : size_(size), valid_(valid), window_(window()) {
    if (!valid.empty()) weight_ = filter([](size_t) { return 1.0; });
  }

  template <class Function>
  ImagePlane operator()(Function value) const {
    ImagePlane mean = filter(value);
    if (!weight_.empty())
      for (size_t i = 0; i < mean.size(); ++i) mean[i] = weight_[i] > 0.0 ? mean[i] / weight_[i] : 0.0;
    return mean;
  }

private:
  template <class Function>
  ImagePlane filter(Function value) const {
    ImagePlane plane(size_.pixels());
    for (size_t i = 0; i < plane.size(); ++i) plane[i] = counts(valid_, i) ? value(i) : 0.0;
    return filter_columns(filter_rows(plane, size_, window_), size_, window_);
  }

  ImageSize size_;
  std::span<const uint8_t> valid_;
  std::array<double, kSsimWindow> window_;
  ImagePlane weight_;
};

/// Adds one channel's SSIM to each pixel of sum.
void add_channel(const Image& test, const Image& reference, uint32_t channel, const WindowMean& mean, ImagePlane& sum) {
  const auto x = [&](size_t i) { return double{test.data[i * test.channels + channel]}; };
  const auto y = [&](size_t i) { return double{reference.data[i * reference.channels + channel]}; };
  const ImagePlane mx = mean(x), my = mean(y);
  const ImagePlane mxx = mean([&](size_t i) { return x(i) * x(i); });
  const ImagePlane myy = mean([&](size_t i) { return y(i) * y(i); });
  const ImagePlane mxy = mean([&](size_t i) { return x(i) * y(i); });
  for (size_t i = 0; i < sum.size(); ++i) {
    const double xx = mx[i] * mx[i], yy = my[i] * my[i], xy = mx[i] * my[i];
    sum[i] += (xy + xy + kC1) * (2.0 * (mxy[i] - xy) + kC2) / ((xx + yy + kC1) * ((mxx[i] - xx) + (myy[i] - yy) + kC2));
  }
}

} // namespace

Metric ssim(const Image& test, const Image& reference, const MetricOptions& options) {
  check_comparable(test, reference, options.valid);
  const ImageSize size = test.size;
  std::vector<uint8_t> counted(size.pixels(), 0);
  bool any = false;
  for (uint32_t y = kRadius; y + kRadius < size.height; ++y)
    for (uint32_t x = kRadius; x + kRadius < size.width; ++x) {
      const size_t i = size_t{y} * size.width + x;
      if (counts(options.valid, i)) counted[i] = 1, any = true;
    }
  if (!any) throw Error(ErrorKind::kInput, "SSIM needs at least one window of 11 x 11 pixels around a valid pixel");

  const WindowMean mean(size, options.valid);
  ImagePlane similarity(size.pixels(), 0.0);
  for (uint32_t c = 0; c < test.channels; ++c) add_channel(test, reference, c, mean, similarity);
  for (double& value : similarity) value /= test.channels;

  Metric metric;
  metric.value = mean_over(size, counted, [&](size_t i) { return similarity[i]; });
  if (options.error_map) metric.error_map = map_over(size, counted, [&](size_t i) { return 1.0 - similarity[i]; });
  return metric;
}

} // namespace packtrace
