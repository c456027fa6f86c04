#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// InstanceSeams in a few numbers.
struct SeamSummary {
  uint64_t instances = 0;   ///< on grids of their own
  uint64_t touching = 0;    ///< of those, in boxes that touch other geometry's
  double largest_gap = 0.0; ///< of their seams at level 0, at most; world units
};

/// The instances of a file that lie on grids of their own and touch other geometry, by their boxes. One point of the
/// source may be decoded to two there: the seam gapes by what both sides lie beside the source. Geometry in world space
/// shares a grid, and has no such seams with other such geometry.
class InstanceSeams {
public:
  /// Takes O(n log n) in the number of instances, unless very many boxes overlap.
  explicit InstanceSeams(const BakedFile& file);

  size_t instance_count() const { return boxes_.size(); }
  /// Instances on grids of their own that touch anything, ascending.
  std::span<const uint32_t> touching() const { return touching_; }

  /// Per entry of touching(): the width of its widest seam at most, world units, at level 0. The position error bound
  /// of both sides (half a step per axis and the roundings of floats), under their transforms.
  const std::vector<double>& gaps() const { return gaps_; }
  SeamSummary summary() const;

  /// Per entry of touching(): the largest value of the other instances that its box touches.
  /// @param values per instance of the file, not negative
  std::vector<double> largest_beside(std::span<const double> values) const;

private:
  std::vector<Bounds> boxes_; ///< by instance, world, as far as decoded points may lie from the source's
  std::vector<uint32_t> touching_;
  std::vector<double> gaps_;
  uint64_t own_grid_count_ = 0;
};

} // namespace packtrace
