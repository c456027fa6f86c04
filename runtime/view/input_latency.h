#pragma once

#include <cstddef>
#include <vector>

namespace packtrace {

/// Times from inputs to the pictures that show them.
class InputLatency {
public:
  void add(double ms);
  /// Number of inputs. Only the last ones count in percentiles.
  size_t count() const { return count_; }
  /// Returns a quantile of the last times; 0 without inputs.
  /// @param fraction in [0, 1]
  double percentile_ms(double fraction) const;

private:
  std::vector<double> last_ms_; ///< the newest overwrites the oldest
  size_t count_ = 0;
};

} // namespace packtrace
