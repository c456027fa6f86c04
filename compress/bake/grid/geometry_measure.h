#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/format/cluster/position_grid.h"
#include "pbrt_import/scene/bounds.h"

namespace packtrace {

/// Lengths counted in bins 1.6 % wide, so that medians of many meshes need no memory and do not depend on order.
class LengthHistogram {
public:
  LengthHistogram() : counts_(kBins) {}

  /// Zero lengths are not counted.
  void add_squared(double squared_length);
  void add(const LengthHistogram& other);
  /// Its lengths times a positive factor, to half a bin.
  void add_scaled(const LengthHistogram& other, double factor);
  void clear();

  /// The lower edge of the median's bin: at most the median and at least .98 of it; 0 if nothing was added.
  double median() const;

private:
  static constexpr uint32_t kMantissaBits = 5; // of the squared length
  static constexpr size_t kBins = size_t{2048} << kMantissaBits;
  std::vector<uint64_t> counts_;
  size_t first_ = kBins, end_ = 0; // bins in use
  uint64_t total_ = 0;
};

/// What choosing a step needs to know of a geometry, or of several together.
struct GeometryMeasure {
  Bounds bounds; ///< geometry space
  double median_edge = 0.0;

  double max_abs() const; ///< largest |coordinate|; 0 where empty
  /// Half the spacing of floats or more, along the axis where it is least: on a lattice of this step the largest
  /// coordinates decode to the floats that they were. 0 where empty or all at 0.
  double float_step() const;
};

/// Box of the geometry; its edge lengths are added to `edges`.
/// Throws Error(kInput) where a position of the geometry is not finite as a float or an index is out of range.
Bounds measure_geometry(const Scene& scene, const GeometryPlan& plan, LengthHistogram& edges);

/// The coarsest grid that keeps config's promise. Where the box is a point and precision relative to it, the step is
/// about the float's own there.
PositionGrid choose_grid(const BakeConfig& config, const GeometryMeasure& measure, double max_stretch);

} // namespace packtrace
