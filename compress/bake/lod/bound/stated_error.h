#pragma once

#include <algorithm>

namespace packtrace {

inline constexpr double kErrorInflation = 1.001; ///< of what was measured, for all roundings

/// The error of what is measured to be that far from something that has an error of its own.
inline double stated_error(double distance, double had) { return distance * kErrorInflation + had; }

/// What is known of a group's error while its triangles are measured. The group is as far off as its worst part: what
/// is hardly worse needs no closer look.
struct GroupError {
  static constexpr double kSlack = 1.1; ///< how much larger than it must be it may be stated to save work
  static constexpr double kFine = 0.5;  ///< steps; distances below need no work

  double largest = 0.0; ///< it is at least this, as stated
  double proven = 0.0;  ///< some triangle's error cannot be below, as far as its candidates go

  double limit() const { return std::max(largest, kSlack * proven); }
  bool enough(double distance, double had) const { return distance <= kFine || stated_error(distance, had) <= limit(); }
};

} // namespace packtrace
