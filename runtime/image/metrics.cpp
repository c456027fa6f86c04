#include "runtime/image/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "runtime/image/metric_support.h"

namespace packtrace {

namespace {

/// Returns a function of the pixel index: the mean of f(difference) over the pixel's channels.
template <class Function>
auto per_pixel(const Image& test, const Image& reference, Function f) {
  return [&test, &reference, f](size_t pixel) {
    double sum = 0.0;
    for (size_t i = pixel * test.channels; i < (pixel + 1) * test.channels; ++i)
      sum += f(double{test.data[i]} - double{reference.data[i]});
    return sum / test.channels;
  };
}

} // namespace

Metric rmse(const Image& test, const Image& reference, const MetricOptions& options) {
  check_comparable(test, reference, options.valid);
  const auto squared = per_pixel(test, reference, [](double d) { return d * d; });
  Metric metric;
  metric.value = std::sqrt(mean_over(test.size, options.valid, squared));
  if (options.error_map)
    metric.error_map = map_over(test.size, options.valid, [&](size_t i) { return std::sqrt(squared(i)); });
  return metric;
}

Metric mae(const Image& test, const Image& reference, const MetricOptions& options) {
  check_comparable(test, reference, options.valid);
  const auto absolute = per_pixel(test, reference, [](double d) { return std::abs(d); });
  Metric metric;
  metric.value = mean_over(test.size, options.valid, absolute);
  if (options.error_map) metric.error_map = map_over(test.size, options.valid, absolute);
  return metric;
}

Metric p99(const Image& test, const Image& reference, const MetricOptions& options) {
  check_comparable(test, reference, options.valid);
  const auto absolute = per_pixel(test, reference, [](double d) { return std::abs(d); });
  std::vector<double> errors;
  for (size_t i = 0; i < test.size.pixels(); ++i)
    if (counts(options.valid, i)) errors.push_back(absolute(i));
  const auto rank = errors.begin() + static_cast<std::ptrdiff_t>((errors.size() * 99 + 99) / 100 - 1);
  std::nth_element(errors.begin(), rank, errors.end());
  Metric metric;
  metric.value = *rank;
  if (options.error_map) metric.error_map = map_over(test.size, options.valid, absolute);
  return metric;
}

Metric psnr(const Image& test, const Image& reference, const MetricOptions& options) {
  Metric metric = rmse(test, reference, options);
  metric.value = metric.value > 0.0 ? -20.0 * std::log10(metric.value) : std::numeric_limits<double>::infinity();
  return metric;
}

} // namespace packtrace
