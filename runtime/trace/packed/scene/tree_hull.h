#pragma once

#include <vector>

#include "compress/format/trees/box_tree.h"
#include "compress/format/layout/packed_node.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The boxes of a tree's topmost nodes: where it lies, more closely than its root's box does.
class TreeHull {
public:
  /// @param nodes of one tree, root first
  explicit TreeHull(const baked::PackedNode* nodes);

  /// The box of all of them, in the tree's grid.
  const DVec3& lo() const { return lo_; }
  const DVec3& hi() const { return hi_; }

  /// Around all of them, in unit space, a little larger than what rays may hit.
  TreeBox placed(const DAffine& unit_from_grid) const;

  /// The same around those below each of the root's children. Without that little more where the grid's axes are those
  /// of unit space: rays are tested against it as against the tree's own boxes.
  std::vector<TreeBox> placed_parts(const DAffine& unit_from_grid, bool aligned) const;

private:
  TreeBox placed(const DAffine& unit_from_grid, double pad, size_t begin, size_t end) const;
  /// What rays in the grid may be off by.
  double pad() const;

  DVec3 lo_, hi_;
  std::vector<double> centre_[3], half_[3]; ///< by axis
  std::vector<size_t> ends_;                ///< of the boxes below each of the root's children
};

} // namespace packtrace
