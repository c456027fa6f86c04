#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace packtrace {

/// Bins of equal width in the logarithm; the first one starts at 0 and the last one includes the largest value.
struct Histogram {
  std::string unit;
  std::vector<double> edges;    ///< ascending, one more than counts; empty if there are no values
  std::vector<uint64_t> counts; ///< add up to the number of values
};

/// @param values at least 0 and finite
Histogram make_histogram(const std::vector<double>& values, std::string unit);

nlohmann::json to_json(const Histogram& histogram);

} // namespace packtrace
