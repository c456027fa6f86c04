#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/format/cluster/position_grid.h"
#include "pbrt_import/scene/bounds.h"

namespace packtrace {

/// Histogram of lengths in bins at most 1.6 % wide. Its medians need no list of lengths and do not depend on their
/// order.
class LengthHistogram {
public:
  LengthHistogram() : counts_(kBins) {}

  /// Zero lengths are not counted.
  void add_squared(double squared_length);
  /// Adds the other histogram's lengths.
  void add(const LengthHistogram& other);
  /// Adds the other histogram's lengths times a positive factor, accurate to half a bin.
  void add_scaled(const LengthHistogram& other, double factor);
  void clear();

  /// Lower edge of the median's bin: at most the median and at least 0.98 of it; 0 if nothing was added.
  double median() const;

private:
  static constexpr uint32_t kMantissaBits = 5; // of the squared length
  static constexpr size_t kBins = size_t{2048} << kMantissaBits;
  std::vector<uint64_t> counts_;
  size_t first_ = kBins, end_ = 0; // range of bins in use
  uint64_t total_ = 0;
};

/// Measurements of one geometry, or of several together, for choosing a step.
struct GeometryMeasure {
  Bounds bounds; ///< geometry space
  double median_edge = 0.0;

  double max_abs() const; ///< largest |coordinate|; 0 if empty
  /// At least 0.5 and less than 1 times the spacing of floats at m, where m is the smallest, over the axes, of the
  /// nonzero largest |coordinate| along the axis. On a lattice of this step, float coordinates near m decode unchanged.
  /// 0 if empty or if all coordinates are 0.
  double float_step() const;
};

/// Returns the bounds of the geometry and adds its edge lengths to `edges`.
/// Throws Error(kInput) if a position of the geometry is not finite as a float or an index is out of range.
Bounds measure_geometry(const Scene& scene, const GeometryPlan& plan, LengthHistogram& edges);

/// Returns the coarsest grid that satisfies config's precision. If that would give a step of 0 (for example a relative
/// precision and bounds that are a point), the step is 2^-24 times the largest |coordinate|, close to the float spacing
/// there.
PositionGrid choose_grid(const BakeConfig& config, const GeometryMeasure& measure, double max_stretch);

} // namespace packtrace
