#include "runtime/measure/histogram.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

namespace packtrace {

Histogram make_histogram(const std::vector<double>& values, std::string unit) {
  constexpr int kBinsPerDecade = 4, kBins = 20; // five decades below the largest value
  Histogram histogram{std::move(unit), {}, {}};
  if (values.empty()) return histogram;
  const double largest = *std::max_element(values.begin(), values.end());
  histogram.edges.push_back(0.0);
  if (!(largest > 0.0)) {
    histogram.edges.push_back(0.0);
    histogram.counts.push_back(values.size());
    return histogram;
  }
  for (int i = 1; i < kBins; ++i)
    histogram.edges.push_back(largest * std::pow(10.0, (i - kBins) / static_cast<double>(kBinsPerDecade)));
  histogram.edges.push_back(largest);
  histogram.counts.assign(kBins, 0);
  for (const double value : values) {
    const auto above = std::upper_bound(histogram.edges.begin(), histogram.edges.end(), value);
    const auto bin = static_cast<size_t>(above - histogram.edges.begin()) - 1;
    ++histogram.counts[std::min(bin, histogram.counts.size() - 1)];
  }
  return histogram;
}

nlohmann::json to_json(const Histogram& histogram) {
  return {{"unit", histogram.unit}, {"edges", histogram.edges}, {"counts", histogram.counts}};
}

} // namespace packtrace
