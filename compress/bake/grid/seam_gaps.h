#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Summary of InstanceSeams.
struct SeamSummary {
  uint64_t instances = 0;   ///< instances on grids of their own
  uint64_t touching = 0;    ///< of those, instances whose bounds touch other geometry's
  double largest_gap = 0.0; ///< upper bound of the seam widths at LOD level 0; world units
};

/// Finds instances on their own grids whose bounds touch other geometry. One point of the source may decode to two
/// points there, so the seam may open by the position errors of both sides. World-space geometries share nested grids
/// and have no such seams between them.
class InstanceSeams {
public:
  /// Takes O(n log n) time in the number of instances, unless very many bounds overlap.
  explicit InstanceSeams(const BakedFile& file);

  size_t instance_count() const { return boxes_.size(); }
  /// Instances on their own grids that touch other instances, ascending.
  std::span<const uint32_t> touching() const { return touching_; }

  /// Per entry of touching(): upper bound of the width of its widest seam at LOD level 0, in world units. It is the sum
  /// of the position error bounds of both sides (half a step per axis plus float rounding) under their transforms.
  const std::vector<double>& gaps() const { return gaps_; }
  /// Counts, and the largest of gaps().
  SeamSummary summary() const;

  /// Returns, per entry of touching(), the largest value of the other instances whose bounds it touches.
  /// @param values per instance of the file, at least 0
  std::vector<double> largest_touching(std::span<const double> values) const;

private:
  std::vector<Bounds> boxes_; ///< world-space bounds per instance, padded by the position error bound
  std::vector<uint32_t> touching_;
  std::vector<double> gaps_;
  uint64_t own_grid_instance_count_ = 0;
};

} // namespace packtrace
