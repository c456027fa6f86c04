#pragma once

#include <vector>

#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/box_tree.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The boxes of a tree's topmost nodes. They bound a rotated tree more tightly than its root's box.
class TreeHull {
public:
  /// @param nodes the nodes of one tree, root first
  explicit TreeHull(const baked::PackedNode* nodes);

  /// Bounds of all boxes, in the tree's grid.
  const DVec3& lo() const { return lo_; }
  const DVec3& hi() const { return hi_; }

  /// Bounds of all boxes in unit space, padded so that they contain everything that rays may hit.
  TreeBox placed(const DAffine& unit_from_grid) const;

  /// The same for the boxes below each of the root's children. Without the padding if the grid's axes are those of unit
  /// space: rays are then tested against these bounds as they are against the tree's own boxes.
  std::vector<TreeBox> placed_parts(const DAffine& unit_from_grid, bool aligned) const;

  uint64_t bytes() const {
    return sizeof(TreeHull) + 6 * centre_[0].size() * sizeof(double) + ends_.size() * sizeof(size_t);
  }

private:
  TreeBox placed(const DAffine& unit_from_grid, double pad, size_t begin, size_t end) const;
  /// Maximum rounding error of rays, in the tree's grid.
  double pad() const;

  DVec3 lo_, hi_;
  std::vector<double> centre_[3], half_[3]; ///< by axis
  std::vector<size_t> ends_;                ///< end of the boxes below each of the root's children
};

} // namespace packtrace
