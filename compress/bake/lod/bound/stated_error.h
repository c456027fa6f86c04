#pragma once

#include <algorithm>

namespace packtrace {

inline constexpr double kErrorInflation = 1.001; ///< factor on measured distances that covers all rounding errors

/// Error bound from a measured distance and the inherited error of the triangle that it was measured to or from.
inline double stated_error(double distance, double inherited) { return distance * kErrorInflation + inherited; }

/// Error bounds of a group while its triangles are measured. The group's error is that of its worst part, so parts
/// below limit() need no closer look.
struct GroupError {
  static constexpr double kSlack = 1.1; ///< allowed overestimate of the error, saves work
  static constexpr double kFine = 0.5;  ///< lattice steps; smaller distances are accepted as they are

  double largest = 0.0; ///< largest error bound accepted so far
  double proven = 0.0;  ///< lower bound of the group's error, given the candidates

  double limit() const { return std::max(largest, kSlack * proven); }
  bool enough(double distance, double inherited) const {
    return distance <= kFine || stated_error(distance, inherited) <= limit();
  }
};

} // namespace packtrace
